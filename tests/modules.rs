//! No circles between the modules of the library: each uses only what stands before it in the list of `src/lib.rs`.
//! Asked of the sources: of every path that begins with `crate`, `super` or `self`, in `use` or elsewhere, but for
//! those of tests and comments.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, Group, Ident, TokenStream, TokenTree};

/// The names of a module, from that of the library's top level on.
type Names = Vec<String>;

/// A path in a source.
#[derive(Debug)]
struct Mention {
    /// The module that has it.
    from: Names,
    /// What it names.
    to: Names,
    /// File and line.
    place: String,
}

/// What is in some sources.
#[derive(Debug, Default)]
struct Sources {
    modules: BTreeSet<Names>,
    mentions: Vec<Mention>,
    /// What a module names as its own, and where it is from.
    reexports: BTreeMap<Names, Names>,
    /// Modules that are compiled for tests alone.
    tests: Vec<Names>,
}

impl Sources {
    /// Adds a file, by its place in `src`.
    fn add(&mut self, file: &Path, text: &str) {
        let names = names_of(file);
        let tokens: TokenStream = text.parse().expect("a source of Rust");
        for end in 1..=names.len() {
            self.modules.insert(names[..end].to_vec());
        }
        let mut reader = Reader {
            file: format!("src/{}", file.display()),
            sources: self,
        };
        reader.read(tokens, &names);
    }

    /// Where a name is from that a module re-exports.
    fn origin(&self, to: &[String]) -> Names {
        let known = (1..=to.len()).rev();
        let known = known.filter_map(|end| Some((end, self.reexports.get(&to[..end])?)));
        let mut known = known.filter(|(end, origin)| to[..*end] != origin[..]);
        known.next().map_or_else(
            || to.to_vec(),
            |(end, origin)| [&origin[..], &to[end..]].concat(),
        )
    }

    /// Which of the modules in `folder` mention which others, with a place of each.
    fn graph(&self, folder: &[String]) -> Graph {
        let depth = folder.len();
        let within = |names: &[String]| names.len() > depth && names[..depth] == *folder;
        let mut graph = Graph::new();
        for mention in &self.mentions {
            let is_test = self.tests.iter().any(|t| mention.from.starts_with(t));
            if is_test || !within(&mention.from) {
                continue;
            }
            let to = self.origin(&mention.to);
            if within(&to)
                && self.modules.contains(&to[..=depth])
                && to[depth] != mention.from[depth]
            {
                let uses = graph.entry(mention.from[depth].clone()).or_default();
                uses.entry(to[depth].clone())
                    .or_insert(mention.place.clone());
            }
        }
        graph
    }

    /// All folders, with the library itself, which has no name.
    fn folders(&self) -> BTreeSet<Names> {
        let parents = self
            .modules
            .iter()
            .map(|names| names[..names.len() - 1].to_vec());
        parents.collect()
    }
}

/// The module that a file is.
fn names_of(file: &Path) -> Names {
    let mut names: Names = file
        .with_extension("")
        .iter()
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    if names
        .last()
        .is_some_and(|name| name == "mod" || name == "lib")
    {
        names.pop();
    }
    names
}

/// Reads one file.
struct Reader<'a> {
    /// As messages name it.
    file: String,
    sources: &'a mut Sources,
}

impl Reader<'_> {
    fn read(&mut self, tokens: TokenStream, module: &[String]) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        // Whether what follows is re-exported.
        let mut exported = false;
        while let Some(token) = tokens.get(at) {
            if is_for_tests(&tokens[at..]) {
                at = self.pass_over(&tokens, at + 2, module);
                continue;
            }
            match token {
                TokenTree::Group(group) => match inline_module(&tokens[..at]) {
                    Some(name) => self.read(group.stream(), &child(module, &name)),
                    None => self.read(group.stream(), module),
                },
                TokenTree::Ident(word) if word == "use" => {
                    exported = at > 0 && is_visibility(&tokens[..at]);
                    if exported && !is_path(&tokens, at + 1) {
                        self.reexport(&tokens, at + 1, module);
                    }
                }
                TokenTree::Punct(end) if end.as_char() == ';' => exported = false,
                TokenTree::Ident(word) if is_path(&tokens, at) => {
                    let start = match word.to_string().as_str() {
                        "crate" => Vec::new(),
                        "self" => module.to_vec(),
                        _ => module[..module.len() - 1].to_vec(),
                    };
                    let mut ends = Vec::new();
                    at = leaves(&tokens, at + 3, &start, &mut ends);
                    for (to, word) in ends {
                        if let Some(name) = to.last().filter(|_| exported) {
                            let own = child(module, name);
                            self.sources.reexports.insert(own, to.clone());
                        }
                        self.sources.mentions.push(Mention {
                            from: module.to_vec(),
                            to,
                            place: format!("{}:{}", self.file, word.span().start().line),
                        });
                    }
                    continue;
                }
                _ => {}
            }
            at += 1;
        }
    }

    /// Takes note of what `pub use child::Name` names.
    fn reexport(&mut self, tokens: &[TokenTree], at: usize, module: &[String]) {
        let mut ends = Vec::new();
        leaves(tokens, at, module, &mut ends);
        for (to, _) in ends {
            if let Some(name) = to.last() {
                let own = child(module, name);
                self.sources.reexports.insert(own, to);
            }
        }
    }

    /// Where the item at `at` ends, which is for tests alone.
    fn pass_over(&mut self, tokens: &[TokenTree], at: usize, module: &[String]) -> usize {
        let ends = |token: &TokenTree| match token {
            TokenTree::Punct(end) => end.as_char() == ';',
            TokenTree::Group(body) => body.delimiter() == Delimiter::Brace,
            _ => false,
        };
        let end = tokens[at..].iter().position(ends);
        let end = end.map_or(tokens.len(), |end| at + end + 1);
        // A file of its own.
        if let [
            ..,
            TokenTree::Ident(word),
            TokenTree::Ident(name),
            TokenTree::Punct(_),
        ] = &tokens[at..end]
            && word == "mod"
        {
            self.sources.tests.push(child(module, &name.to_string()));
        }
        end
    }
}

fn child(module: &[String], name: &str) -> Names {
    [module, &[name.to_owned()]].concat()
}

/// Whether these begin with `#[cfg(test)]`.
fn is_for_tests(tokens: &[TokenTree]) -> bool {
    let [TokenTree::Punct(hash), TokenTree::Group(attribute), ..] = tokens else {
        return false;
    };
    let text: String = attribute.stream().to_string().split_whitespace().collect();
    hash.as_char() == '#' && text == "cfg(test)"
}

/// The name of the module whose body comes after these.
fn inline_module(before: &[TokenTree]) -> Option<String> {
    match before {
        [.., TokenTree::Ident(word), TokenTree::Ident(name)] if word == "mod" => {
            Some(name.to_string())
        }
        _ => None,
    }
}

/// Whether these end with `pub`, or with `pub(...)`.
fn is_visibility(before: &[TokenTree]) -> bool {
    let is_pub = |token: &TokenTree| matches!(token, TokenTree::Ident(word) if word == "pub");
    match before {
        [.., word] if is_pub(word) => true,
        [.., word, TokenTree::Group(_)] => is_pub(word),
        _ => false,
    }
}

/// Whether `::` stands at `at`.
fn is_separator(tokens: &[TokenTree], at: usize) -> bool {
    let colon = |at: usize| match tokens.get(at) {
        Some(TokenTree::Punct(colon)) => colon.as_char() == ':',
        _ => false,
    };
    colon(at) && colon(at + 1)
}

/// Whether a path from the library or from this module begins at `at`.
fn is_path(tokens: &[TokenTree], at: usize) -> bool {
    let begins = |word: &Ident| ["crate", "super", "self"].iter().any(|start| word == start);
    matches!(&tokens[at], TokenTree::Ident(word) if begins(word)) && is_separator(tokens, at + 1)
}

/// Adds all paths that begin with `start` and go on at `at`, each with its last word; where they end.
fn leaves(
    tokens: &[TokenTree],
    mut at: usize,
    start: &[String],
    ends: &mut Vec<(Names, Ident)>,
) -> usize {
    let mut path = start.to_vec();
    loop {
        match tokens.get(at) {
            Some(TokenTree::Ident(word)) => {
                match word.to_string().as_str() {
                    "super" => drop(path.pop()),
                    "self" => {}
                    name => path.push(name.to_owned()),
                }
                at += 1;
                if !is_separator(tokens, at) {
                    ends.push((path, word.clone()));
                    return at;
                }
                // What may follow a separator and is no part of the path: types in `<>`, and `*`.
                match tokens.get(at + 2) {
                    Some(TokenTree::Ident(_) | TokenTree::Group(_)) => at += 2,
                    _ => {
                        ends.push((path, word.clone()));
                        return at + 2;
                    }
                }
            }
            Some(TokenTree::Group(group)) => {
                in_braces(group, &path, ends);
                return at + 1;
            }
            _ => return at,
        }
    }
}

/// The same of `{a, b::c}`.
fn in_braces(group: &Group, start: &[String], ends: &mut Vec<(Names, Ident)>) {
    let tokens: Vec<TokenTree> = group.stream().into_iter().collect();
    let is_comma = |token: &TokenTree| matches!(token, TokenTree::Punct(p) if p.as_char() == ',');
    for part in tokens.split(is_comma) {
        leaves(part, 0, start, ends);
    }
}

/// For each module those that it uses, with a place of each.
type Graph = BTreeMap<String, BTreeMap<String, String>>;

/// The shortest circle, as lines that name each step's place.
fn shortest_circle(graph: &Graph) -> Option<Vec<String>> {
    let circles = graph.keys().filter_map(|start| circle_from(graph, start));
    circles.min_by_key(Vec::len)
}

/// The shortest circle through a module.
fn circle_from(graph: &Graph, start: &str) -> Option<Vec<String>> {
    let mut from: BTreeMap<&str, &str> = BTreeMap::new();
    let mut next = VecDeque::from([start]);
    while let Some(module) = next.pop_front() {
        for to in graph.get(module).into_iter().flat_map(BTreeMap::keys) {
            if !from.contains_key(to.as_str()) {
                from.insert(to, module);
                next.push_back(to);
            }
        }
    }
    let mut lines = Vec::new();
    let mut to = start;
    loop {
        let before = from.get(to)?;
        lines.push(format!("{before} uses {to}: {}", graph[*before][to]));
        to = before;
        if to == start {
            lines.reverse();
            return Some(lines);
        }
    }
}

fn sources_of(files: &[(&str, &str)]) -> Sources {
    let mut sources = Sources::default();
    for (file, text) in files {
        sources.add(Path::new(file), text);
    }
    sources
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All of the library's; not those of the program around it.
fn library() -> Sources {
    fn add(sources: &mut Sources, folder: &Path) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                add(sources, &path);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("src/main.rs")
            {
                let text = fs::read_to_string(&path).expect("a source");
                sources.add(path.strip_prefix(root()).expect("in src"), &text);
            }
        }
    }
    let mut sources = Sources::default();
    add(&mut sources, &root());
    sources
}

/// The modules of the top level.
fn modules_of(sources: &Sources) -> BTreeSet<String> {
    let modules = sources.modules.iter().filter(|names| names.len() == 1);
    modules.map(|names| names[0].clone()).collect()
}

/// Those of `modules` that stand in backquotes in some lines, in their order.
fn named<'t>(lines: impl Iterator<Item = &'t str>, modules: &BTreeSet<String>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for name in lines.flat_map(|line| line.split('`').skip(1).step_by(2)) {
        if modules.contains(name) && !found.iter().any(|known| known == name) {
            found.push(name.to_owned());
        }
    }
    found
}

/// The uses of modules that come later in `order`, or are not in it.
fn out_of_order(graph: &Graph, order: &[String]) -> Vec<String> {
    let place = |name: &str| order.iter().position(|module| module == name);
    let uses = graph
        .iter()
        .flat_map(|(from, to)| to.iter().map(move |(to, at)| (from, to, at)));
    uses.filter(|(from, to, _)| place(to).is_none() || place(to) >= place(from))
        .map(|(from, to, at)| format!("{from} uses {to}: {at}"))
        .collect()
}

#[test]
fn there_are_no_circles() {
    let sources = library();
    for folder in sources.folders() {
        let circle = shortest_circle(&sources.graph(&folder));
        let lines = circle.unwrap_or_default().join("\n");
        assert!(
            lines.is_empty(),
            "a circle in src/{}:\n{lines}",
            folder.join("/")
        );
    }
}

/// That a document names every module, each after those that it uses.
fn assert_order(document: &str, sources: &Sources, order: &[String]) {
    let missing: Vec<String> = modules_of(sources)
        .into_iter()
        .filter(|name| !order.contains(name))
        .collect();
    assert!(missing.is_empty(), "{document} says nothing of {missing:?}");
    let wrong = out_of_order(&sources.graph(&[]), order).join("\n");
    assert!(
        wrong.is_empty(),
        "{document} names these the other way round:\n{wrong}"
    );
}

#[test]
fn modules_stand_in_the_order_of_the_documentation() {
    let sources = library();
    let text = fs::read_to_string(root().join("lib.rs")).expect("src/lib.rs");
    let lines = text.lines().filter(|line| line.starts_with("//!"));
    let order = named(lines, &modules_of(&sources));
    assert_order("src/lib.rs", &sources, &order);
}

/// The table of `ARCHITECTURE.md` has every module, in such an order, too.
#[test]
fn modules_stand_in_the_order_of_the_architecture() {
    let sources = library();
    let modules = modules_of(&sources);
    let text = fs::read_to_string(root().join("../ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let rows = text
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split(" | ").next());
    let order = named(rows, &modules);
    assert_order("ARCHITECTURE.md", &sources, &order);
}

/// A circle of three, hidden in braces, behind `super` and in a module of a module.
const CIRCLE: [(&str, &str); 4] = [
    ("lib.rs", "pub mod a; pub mod b; pub mod c;"),
    (
        "a.rs",
        "use crate::{\n    error,\n    b::{self, Other},\n};",
    ),
    (
        "b/mod.rs",
        "mod inner {\n    fn f() -> super::super::c::Thing { todo() }\n}",
    ),
    (
        "c.rs",
        "/* crate::nothing */\n// crate::nothing\nfn g(s: &str) {\n    crate::a::h::<u8>(\"crate::b\")\n}",
    ),
];

#[test]
fn companion_a_circle_is_found_with_its_places() {
    let graph = sources_of(&CIRCLE).graph(&[]);
    let expected = [
        "a uses b: src/a.rs:3",
        "b uses c: src/b/mod.rs:2",
        "c uses a: src/c.rs:4",
    ];
    assert_eq!(shortest_circle(&graph).expect("a circle"), expected);
    // Any order is wrong somewhere.
    let order = ["a", "b", "c"].map(str::to_owned);
    assert_eq!(out_of_order(&graph, &order), expected[..2]);
    assert_eq!(out_of_order(&graph, &order[1..]), expected);
}

/// What tests use is no circle; what comes after them is.
#[test]
fn companion_tests_are_left_out() {
    let within = "#[cfg(test)]\nmod tests {\n    use crate::b::x;\n}\n";
    let file = ("b.rs", "fn f() { crate::a::g() }");
    let own = [("a.rs", within), file];
    assert_eq!(shortest_circle(&sources_of(&own).graph(&[])), None);
    let apart = [
        ("a/mod.rs", "#[cfg(test)]\nmod tests;"),
        ("a/tests.rs", "use crate::b::x;"),
        file,
    ];
    assert_eq!(shortest_circle(&sources_of(&apart).graph(&[])), None);
    let after = format!("{within}fn h() {{ crate::b::f() }}");
    let circle = shortest_circle(&sources_of(&[("a.rs", &after), file]).graph(&[]));
    assert_eq!(circle.expect("a circle").len(), 2);
}

/// A folder's parts may use each other by names that the folder re-exports.
#[test]
fn companion_a_circle_within_a_folder_is_found() {
    let files = [
        (
            "a/mod.rs",
            "mod x;\nmod y;\npub use x::{X, other};\npub(crate) use self::y::Y;",
        ),
        ("a/x.rs", "use super::y;"),
        ("a/y.rs", "use super::X;"),
    ];
    let sources = sources_of(&files);
    let folder = ["a".to_owned()];
    let circle = shortest_circle(&sources.graph(&folder)).expect("a circle");
    assert_eq!(circle, ["x uses y: src/a/x.rs:1", "y uses x: src/a/y.rs:1"]);
    assert!(sources.folders().contains(&folder[..]));
    let by_name = [files[0], ("a/x.rs", "use super::Y;"), files[2]];
    assert!(shortest_circle(&sources_of(&by_name).graph(&folder)).is_some());
}
