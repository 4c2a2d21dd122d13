//! What the documents tell readers to type is what the program understands.

use std::fs;
use std::path::Path;

use clap::Parser as _;

use super::{AFTER_HELP, Cli};

/// The commands of this program in a text: lines of their own, indented.
fn commands(text: &str) -> Vec<&str> {
    let lines = text.lines().filter(|line| line.starts_with(' '));
    let lines = lines.map(|line| line.trim_start_matches([' ', '$']));
    lines
        .filter(|line| line.starts_with("gpu-trace ") || *line == "gpu-trace")
        .collect()
}

/// The words that the program gets of what is typed into a shell: all up to a comment, a redirection or, after
/// two spaces, what help says of it.
fn words(command: &str) -> Vec<&str> {
    let typed = command.split("  ").next().unwrap_or_default();
    let words = typed.split_whitespace();
    words
        .take_while(|word| !word.starts_with(['#', '>', '|']))
        .collect()
}

/// What is not understood of a text's commands, and how many there are.
fn faults(text: &str) -> (Vec<String>, usize) {
    let commands = commands(text);
    let fault = |command: &&str| {
        let parsed = Cli::try_parse_from(words(command));
        parsed.err().map(|error| format!("{command}\n{error}"))
    };
    (commands.iter().filter_map(fault).collect(), commands.len())
}

#[test]
fn all_that_documents_say_to_type_is_understood() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = vec![root.join("README.md"), root.join("CONTRIBUTING.md")];
    let docs = fs::read_dir(root.join("docs")).expect("docs/");
    files.extend(docs.map(|entry| entry.expect("an entry of docs/").path()));
    let mut all = faults(AFTER_HELP).1;
    assert_eq!(faults(AFTER_HELP).0, [""; 0]);
    for file in files
        .iter()
        .filter(|f| f.extension().is_some_and(|e| e == "md"))
    {
        let text = fs::read_to_string(file).expect("a document");
        let (faults, count) = faults(&text);
        assert!(
            faults.is_empty(),
            "{}: {}",
            file.display(),
            faults.join("\n")
        );
        all += count;
    }
    assert!(all > 50, "{all}");
}

/// Companion: options and values that there are not.
#[test]
fn companion_what_is_not_understood_is_found() {
    for wrong in [
        "glass --sp 4",
        "glass --backend cuda",
        "effects --measure-all",
    ] {
        let text = format!("As in\n\n    gpu-trace {wrong}   # so\n");
        assert_eq!((faults(&text).0.len(), faults(&text).1), (1, 1), "{wrong}");
    }
    let right =
        "    gpu-trace scene list lecture > a.toml\n    gpu-trace glass --spp 4      some words\n";
    assert_eq!(faults(right), (Vec::new(), 2));
}
