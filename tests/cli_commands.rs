//! The commands beside `render`, through the program's binary.

use crate::cli_support::{BLACK, Folder, holds};
use gpu_trace::effects::Effect;
use gpu_trace::scene::builtin;
use gpu_trace::shader::declared_names;
use serde_json::{Value, json};

/// All commands, and all options of `render`.
const COMMANDS: &str =
    "render resume merge submit effects price check compare converge devices scene completions man";
const OPTIONS: &str = "--output --stats --aov --exposure --dump-wgsl --progress --quiet --verbose \
    --spp --adaptive --error --time --sample-range --size --crop --seed --integrator \
    --light-sampling --sampler --max-bounces \
    --radiance-cache --lamp-images --roulette --termination --backend --device --offset --geometry --threads --allow-non-finite \
    --color-by --radius-by --map --background --frames --view --checkpoint --checkpoint-every";

#[test]
fn the_kernel_holds_what_the_scene_asks_for() {
    let folder = Folder::with_scene();
    for scene in [
        "lecture",
        "lecture --integrator lecture",
        "lecture-reflective",
        "glass",
        "field",
        "good.toml",
        "good.toml --geometry list",
        "good.toml --geometry bvh",
    ] {
        // The kernel holds the camera, whose constants follow from the size.
        let scene = &format!("{scene} --size 2x2");
        let table: Value =
            serde_json::from_str(&folder.ok(&format!("effects {scene} --json"))).expect("JSON");
        let text = folder.ok(&format!("effects {scene}"));
        let (inside, outside) = text.split_once("Left out").expect("two parts");
        let run = folder.run(&format!(
            "{scene} --spp 64 --dump-wgsl k.wgsl -o r.npy --stats r.json"
        ));
        // The lecture's estimator has a warning about its variance to give.
        assert_eq!(run.code, Some(0), "{scene}: {run:?}");
        let wgsl = String::from_utf8(folder.read("k.wgsl")).expect("text");
        let module = naga::front::wgsl::parse_str(&wgsl).unwrap_or_else(|e| panic!("{scene}: {e}"));
        naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::all(),
        )
        .validate(&module)
        .unwrap_or_else(|e| panic!("{scene}: {e:?}"));

        let names = declared_names(&module);
        let mut used = Vec::new();
        for effect in table["effects"].as_array().expect("a list") {
            let name = effect["name"].as_str().expect("a name");
            let uses = effect["used"].as_bool().expect("a truth");
            assert_eq!(
                effect["reasons"].as_array().map(Vec::is_empty),
                Some(!uses),
                "{effect}"
            );
            let row = Effect::named(name).expect("an effect").row();
            let found = names.iter().find(|name| row.is_marked(name));
            assert_eq!(
                found.is_some(),
                uses && !row.marks.is_empty(),
                "{scene}: {name} in the kernel, {found:?}"
            );
            let row = format!("\n  {name} ");
            assert_eq!(
                (inside.contains(&row), outside.contains(&row)),
                (uses, !uses),
                "{text}"
            );
            used.extend(uses.then(|| json!(name)));
        }
        assert_eq!(
            folder.json("r.json")["effects"],
            Value::from(used),
            "{scene}"
        );
        assert_eq!(table["kernel_lines"], json!(wgsl.lines().count()));
        // The same kernel without a render.
        folder.ok(&format!("effects {scene} --dump-wgsl again.wgsl"));
        let again = String::from_utf8(folder.read("again.wgsl")).expect("text");
        // The order of the modules is the linker's.
        let sorted = |text: &str| {
            let mut lines: Vec<String> = text.lines().map(String::from).collect();
            lines.sort();
            lines
        };
        assert!(sorted(&again) == sorted(&wgsl), "{scene}");
    }
}

#[test]
fn devices_are_listed_with_what_they_can() {
    let folder = Folder::new();
    let rows: Value = serde_json::from_str(&folder.ok("devices --json")).expect("JSON");
    let text = folder.ok("devices");
    let rows = rows.as_array().expect("a list");
    assert!(!rows.is_empty(), "these tests need an adapter");
    for (index, row) in rows.iter().enumerate() {
        assert_eq!(row["index"], json!(index));
        let name = row["name"].as_str().expect("a name");
        holds(&text, &[&format!("{index}: {name} (")]);
        assert!(
            row["usable"].is_boolean() && row["driver"].is_string(),
            "{row}"
        );
        assert!(
            row["limits"]["texture_side"].as_u64() >= Some(2048),
            "{row}"
        );
    }
    holds(&text, &["--backend cpu"]);
}

#[test]
fn scenes_are_checked_described_and_listed() {
    let folder = Folder::with_scene();
    holds(
        &folder.ok("scene check good.toml"),
        &["8 x 6 pixels", "spheres      3", "lens of radius 0.1"],
    );
    holds(&folder.ok("scene check"), &["lecture", "spheres      7"]);
    folder.write("black.toml", BLACK);
    let warned = folder.ok("scene check black.toml");
    holds(
        &warned,
        &[
            "lights       none",
            "\nwarning: the scene has no light",
            "black.toml:",
        ],
    );
    let schema: Value = serde_json::from_str(&folder.ok("scene schema")).expect("JSON");
    assert!(schema["properties"]["camera"].is_object());
    let list = folder.ok("scene list");
    assert_eq!(list.lines().count(), builtin::GALLERY.len());
    for scene in builtin::GALLERY {
        holds(&list, &[scene.name, scene.description]);
        // What is printed is a scene file, and the same scene.
        folder.write(
            "copy.toml",
            folder.ok(&format!("scene list {}", scene.name)),
        );
        let hash = |word: &str| {
            let text = folder.ok(&format!("scene check {word}"));
            text.lines()
                .next()
                .and_then(|line| line.split('(').nth(1))
                .map(String::from)
        };
        assert_eq!(hash("copy.toml"), hash(scene.name));
    }
}

#[test]
fn help_version_completions_and_manual() {
    let folder = Folder::new();
    let version = concat!("gpu-trace ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(folder.ok("--version"), version);
    assert_eq!(folder.ok("-V"), version);
    let words = |text: &str| {
        text.split_whitespace()
            .map(String::from)
            .collect::<Vec<_>>()
    };
    let mut long = Vec::new();
    for help in ["--help", "-h", "help", "render --help"] {
        long = words(&folder.ok(help));
        let commands = if help.starts_with("render") {
            ""
        } else {
            COMMANDS
        };
        for word in OPTIONS
            .split_whitespace()
            .chain(commands.split_whitespace())
        {
            assert!(
                long.iter().any(|w| w == word),
                "{help} does not name {word}"
            );
        }
    }
    // And no option is missing in this test's list.
    for word in long.iter().map(|word| word.trim_end_matches(',')) {
        let known = format!("{OPTIONS} --help")
            .split_whitespace()
            .any(|option| option == word);
        assert!(
            known || !word.starts_with("--"),
            "{word} is not in this test's list"
        );
    }
    for command in COMMANDS.split_whitespace() {
        holds(
            &folder.ok(&format!("{command} --help")),
            &["Usage: gpu-trace", command],
        );
    }
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = folder.ok(&format!("completions {shell}"));
        holds(
            &script,
            &["sample-range", "dump-wgsl", "completions", "gpu-trace"],
        );
    }
    let manual = folder.ok("man");
    holds(
        &manual,
        &[".TH gpu-trace 1", "sample\\-range", "Exit codes"],
    );
    assert_eq!(folder.names(), [""; 0], "nothing of this writes a file");
}

#[test]
fn colours_are_for_those_who_want_them() {
    let folder = Folder::new();
    let escapes = |variables: &[(&str, &str)]| {
        let mut command = folder.command("--nonsense");
        let output = command
            .envs(variables.iter().copied())
            .output()
            .expect("it runs");
        output.stderr.contains(&0x1b)
    };
    assert!(!escapes(&[]));
    assert!(escapes(&[("CLICOLOR_FORCE", "1")]));
    assert!(!escapes(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]));
}
