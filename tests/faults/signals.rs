//! Signals that end a render, or do not.

use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use serde_json::json;

use crate::cli_support::{Background, Folder, holds};

/// On one thread, the first paths of this furnace take longer than any test; and it is small, so that they
/// begin at once.
const ENDLESS: &str = "
    camera = { position = [0, 0, 0], look_at = [0, 0, 1], fov = 40 }
    image = { width = 64, height = 64 }
    render = { max_bounces = 65535 }
    material.wall = { type = \"diffuse\", albedo = [1, 1, 1], emission = [1, 1, 1] }
    sphere = [{ center = [0, 0, 0], radius = 1, material = \"wall\" }]
";

#[test]
fn a_terminal_that_closes_ends_a_render_with_what_there_is() {
    let folder = Folder::new();
    folder.write("r.npy", "old");
    let arguments = "--size 16x16 --time 1h --progress json -o r.npy --stats r.json";
    let mut run = Background::start(&folder, arguments);
    run.wait_for("\"progress\"");
    run.signal("HUP");
    let run = run.finish();
    assert_eq!(run.code, Some(129), "{run:?}");
    holds(&run.stdout, &["r.npy: 16x16", "interrupted"]);
    assert_eq!(folder.json("r.json")["stopped_by"], json!("interrupt"));
    assert_eq!(folder.npy("r.npy").pixels.len(), 256);
    assert_eq!(folder.names(), ["r.json", "r.npy"]);
}

#[test]
fn a_hangup_that_comes_twice_waits_and_one_that_is_ignored_does_nothing() {
    let folder = Folder::new();
    folder.write("endless.toml", ENDLESS);
    let arguments = "endless.toml --backend cpu --threads 1 -v -o r.npy";
    let mut run = Background::start(&folder, arguments);
    run.wait_for("effects:");
    // A signal before the first path would end it rightly.
    run.wait_for_work(Duration::from_millis(500));
    for _ in 0..2 {
        run.signal("HUP");
        sleep(Duration::from_millis(200));
        assert!(run.runs(), "the paths under way are waited for");
    }
    for _ in 0..2 {
        sleep(Duration::from_millis(50));
        run.signal("INT");
    }
    assert_eq!(run.finish().code, Some(130));

    // As `nohup` starts it.
    let mut command = Command::new("sh");
    command
        .args(["-c", "trap '' HUP; exec \"$0\" \"$@\""])
        .arg(env!("CARGO_BIN_EXE_gpu-trace"))
        .args("--size 4x4 --time 1h --progress json -o r.npy".split_whitespace())
        .current_dir(folder.path(""));
    let mut run = Background::of(command);
    run.wait_for("\"progress\"");
    run.signal("HUP");
    sleep(Duration::from_millis(300));
    assert!(run.runs());
    run.signal("TERM");
    assert_eq!(run.finish().code, Some(143));
}
