//! The kernel's sources as they would be had an effect never been written.
//!
//! By text, and knowing nothing of how the linker reads conditions: so that a kernel without the effect can be held
//! against the one that is linked from all sources.

use crate::effects::{Effect, Effects};

/// Whether the file below `shaders/` at `path` is there for `effect` alone, in kernels that otherwise have `effects`.
pub(super) fn is_own(path: &str, effect: Effect, effects: &Effects) -> bool {
    let others: Vec<Effect> = effects.used().filter(|used| *used != effect).collect();
    let others = Effects::of(&others);
    let plays = |effects: &Effects| effects.roles().iter().any(|role| role.file == Some(path));
    let plays_with_it = plays(&others.with(&[effect], "")) && !plays(&others);
    plays_with_it || effect.row().is_marked(&path.replace('/', "::"))
}

/// The text without what needs `effect`: what stands after an `@if` that does not hold without it, and functions
/// that are its own.
pub(super) fn strip(text: &str, effect: Effect) -> String {
    let row = effect.row();
    let kept = remove(text, "@if(", |rest| {
        let length = closing(rest)?;
        (holds(&rest[..length], row.name) == Some(false)).then_some(length + 1)
    });
    remove(&kept, "fn ", |rest| {
        let length = rest.find('(')?;
        row.is_marked(&rest[..length]).then_some(0)
    })
}

/// The text without the nodes that begin with `word` and for which `is_gone`, asked with what follows the word, says
/// where the search for the node's end begins. An `@else` after such a node loses its condition.
fn remove(text: &str, word: &str, is_gone: impl Fn(&str) -> Option<usize>) -> String {
    let (mut kept, mut rest) = (String::new(), text);
    while let Some(at) = rest.find(word) {
        let after = at + word.len();
        // A word, not the end of one, and not in a comment.
        let line = rest[..at].rfind('\n').map_or(0, |end| end + 1);
        let begins = !rest[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let node = match begins && !rest[line..at].contains("//") {
            true => is_gone(&rest[after..]),
            false => None,
        };
        let Some(begin) = node else {
            kept += &rest[..after];
            rest = &rest[after..];
            continue;
        };
        kept += &rest[..at];
        let is_block = word == "fn ";
        rest = &rest[after + begin + end_of_node(&rest[after + begin..], is_block)..];
        rest = match rest.trim_start().strip_prefix("@else") {
            Some(other) => other,
            None => rest,
        };
    }
    kept + rest
}

/// Where the parenthesis that is open before `text` closes.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 1;
    text.find(|c| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        depth == 0
    })
}

/// What a condition says if the flag `off` is off and no other one is known.
fn holds(condition: &str, off: &str) -> Option<bool> {
    // No condition of the sources nests: a sum of products, as in `a && !b || c`.
    let literal = |text: &str| match text.trim() {
        name if name == off => Some(false),
        name if name.strip_prefix('!') == Some(off) => Some(true),
        _ => None,
    };
    let product = |text: &str| {
        let all: Vec<_> = text.split("&&").map(literal).collect();
        if all.contains(&Some(false)) {
            Some(false)
        } else {
            all.iter().all(|l| *l == Some(true)).then_some(true)
        }
    };
    let any: Vec<_> = condition.split("||").map(product).collect();
    if any.contains(&Some(true)) {
        Some(true)
    } else {
        any.iter().all(|p| *p == Some(false)).then_some(false)
    }
}

/// Words with which a node begins that ends with its braces.
const BLOCKS: [&str; 7] = ["fn", "struct", "if", "for", "while", "loop", "{"];

/// Whether a declaration's text so far has a bracket of a type or an address space.
fn is_typed(text: &str) -> bool {
    text.contains("array<") || text.contains("var<")
}

/// The length of the declaration, statement, member or parameter with which `text` begins; `is_block`: its first word
/// is gone, and was one of the [`BLOCKS`].
fn end_of_node(text: &str, is_block: bool) -> usize {
    let mut first = text.trim_start();
    // Attributes.
    while let Some(attribute) = first.strip_prefix('@') {
        let name = attribute.find(|c: char| !c.is_alphanumeric() && c != '_');
        first = &attribute[name.unwrap_or(attribute.len())..];
        if let Some(arguments) = first.strip_prefix('(') {
            first = &arguments[closing(arguments).map_or(arguments.len(), |end| end + 1)..];
        }
        first = first.trim_start();
    }
    let is_block = is_block
        || BLOCKS.iter().any(|word| {
            let after = first.strip_prefix(word);
            after.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
        });
    let mut depth = 0;
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        if text[at..].starts_with("//") {
            at += text[at..].find('\n').unwrap_or(text.len() - at);
            continue;
        }
        match c {
            // Of types and address spaces: nothing else in the sources has a comma between such brackets.
            '<' if ["array", "var"]
                .iter()
                .any(|word| text[..at].ends_with(word)) =>
            {
                depth += 1
            }
            '>' if depth > 0 && is_typed(&text[..at]) && !is_block => depth -= 1,
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' if depth == 0 => return at,
            ')' | ']' => depth -= 1,
            '}' => {
                depth -= 1;
                let rest = text[at + 1..].trim_start();
                if depth == 0 && is_block && !rest.starts_with("else") {
                    return at + 1;
                }
            }
            ';' | ',' if depth == 0 => return at + 1,
            _ => {}
        }
        at += c.len_utf8();
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_needs_an_effect_is_gone() {
        let text = "\
@if(lens) import package::scene::lens::{a, b};
import package::c;
struct S {
    @if(lens && pole) a: array<vec3f, 2>,
    @if(!lens) b: f32,
    @if(lens || pole) c: f32,
}
fn f(@if(lens) x: f32, y: f32) -> f32 {
    // @if(lens) is no condition here; nor is this
    @if(lens) { g(); h(1, 2); }
    @if(lens) let z = 1.0;
    @else let z = 2.0;
    @if(lens) if x { y } else { z }
    return y;
}
@if(lens) @must_use() fn g() { if a { b } }
@if(lens) const C = 2;
";
        let without = "
import package::c;
struct S {
    
    @if(!lens) b: f32,
    @if(lens || pole) c: f32,
}
fn f( y: f32) -> f32 {
    // @if(lens) is no condition here; nor is this
    
     let z = 2.0;
    
    return y;
}


";
        assert_eq!(strip(text, Effect::Lens), without);
        assert_eq!(strip(text, Effect::Baked), text);
    }

    #[test]
    fn functions_of_a_form_are_gone() {
        let text = "fn sample_mirror(a: f32) -> f32 { return a; }\nfn sample_mirrors() {}\n";
        let code = crate::materials::forms()
            .iter()
            .position(|form| form.name == "mirror");
        let mirror = Effect::Form(code.expect("a form") as u32);
        assert_eq!(strip(text, mirror), "\nfn sample_mirrors() {}\n");
    }
}
