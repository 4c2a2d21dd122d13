//! The program among other processes: signals, closed pipes, full devices.
#![cfg(unix)]

use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::cli_support::{Background, Folder, Run, holds};
use crate::common::images::assert_same;
use serde_json::json;

#[test]
fn a_signal_ends_a_render_with_what_there_is() {
    for (signal, backend, code) in [
        ("INT", "gpu", 130),
        ("TERM", "gpu", 143),
        ("INT", "cpu", 130),
    ] {
        let folder = Folder::new();
        folder.write("r.npy", "old");
        let arguments = "--size 16x16 --time 1h --progress json -o r.npy -o r.png --stats r.json";
        let mut run = Background::start(&folder, &format!("{arguments} --backend {backend}"));
        run.wait_for("\"progress\"");
        sleep(Duration::from_millis(300));
        run.signal(signal);
        let run = run.finish();
        assert_eq!(run.code, Some(code), "{signal} on {backend}: {run:?}");
        holds(&run.stdout, &["r.npy, r.png: 16x16", "interrupted"]);
        assert!(!run.stderr.contains("error: "), "{run:?}");
        assert_eq!(folder.names(), ["r.json", "r.npy", "r.png"]);
        let stats = folder.json("r.json");
        assert_eq!(stats["stopped_by"], json!("interrupt"));
        assert_eq!(stats["backend"], json!(backend));
        assert_eq!(
            stats["samples"].as_u64(),
            stats["spp"].as_u64().map(|spp| spp * 256)
        );
        assert!(image::open(folder.path("r.png")).is_ok());
        // A part of the render is the render of a part.
        let spp = stats["spp"].as_u64().expect("a number");
        let part = folder.npy("r.npy");
        let sample = format!("--size 16x16 --spp {spp} --backend {backend}");
        let name = format!("SIG{signal} on {backend}");
        assert_same(name, &part, &folder.render(&sample).0);
    }
}

#[test]
fn a_second_signal_ends_it_at_once() {
    // On one thread, the first paths of this furnace take longer than any test; and it is small, so that they
    // begin at once.
    let scene = "
        camera = { position = [0, 0, 0], look_at = [0, 0, 1], fov = 40 }
        image = { width = 64, height = 64 }
        render = { max_bounces = 65535 }
        material.wall = { type = \"diffuse\", albedo = [1, 1, 1], emission = [1, 1, 1] }
        sphere = [{ center = [0, 0, 0], radius = 1, material = \"wall\" }]
    ";
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let folder = Folder::new();
        folder.write("endless.toml", scene);
        folder.write("r.npy", "old");
        let before = folder.snapshot();
        let arguments = "endless.toml --backend cpu --threads 1 -v -o r.npy --stats r.json";
        let mut run = Background::start(&folder, arguments);
        run.wait_for("effects:");
        // A signal before the first path would end it rightly.
        run.wait_for_work(Duration::from_millis(500));
        run.signal(signal);
        sleep(Duration::from_millis(300));
        assert!(run.runs(), "the first one waits for the paths under way");
        run.signal(signal);
        let run = run.finish();
        assert_eq!((run.code, run.stdout.as_str()), (Some(code), ""), "{run:?}");
        assert_eq!(before, folder.snapshot());
    }
}

#[test]
fn a_reader_who_has_seen_enough_is_no_error() {
    let folder = Folder::new();
    for arguments in [
        "effects",
        "effects field --json",
        "devices",
        "scene schema",
        "scene list field",
        "completions bash",
        "man",
        "--help",
        "--size 4x4 --spp 1 -o r.npy",
    ] {
        let mut command = folder.command(arguments);
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        let run = Run::new(output);
        assert_eq!(
            (run.code, run.stderr.as_str()),
            (Some(0), ""),
            "{arguments}"
        );
    }
    assert_eq!(folder.npy("r.npy").pixels.len(), 16);
}

#[test]
fn nobody_needs_to_watch_the_progress() {
    let folder = Folder::new();
    let mut command = folder.command("--size 4x4 --time 0.2 --progress json -v -o r.npy");
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stderr.take());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    assert_eq!(folder.npy("r.npy").pixels.len(), 16);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_fails_alone() {
    let folder = Folder::new();
    std::os::unix::fs::symlink("/dev/full", folder.path("full.npy")).expect("a link");
    let run = folder.run("--size 4x4 --spp 1 -o full.npy -o fine.npy --stats r.json");
    assert_eq!(run.code, Some(1), "{run:?}");
    holds(
        &run.stderr,
        &["error: cannot write full.npy: No space left"],
    );
    assert_eq!(folder.npy("fine.npy").pixels.len(), 16);
    assert_eq!(folder.json("r.json")["spp"], json!(1));
    assert_eq!(folder.names(), ["fine.npy", "full.npy", "r.json"]);

    let full = std::fs::File::options()
        .write(true)
        .open("/dev/full")
        .expect("a device");
    let mut command = folder.command("effects");
    let output = command.stdout(full).output().expect("it runs");
    assert_eq!(output.status.code(), Some(1));
    holds(
        &String::from_utf8_lossy(&output.stderr),
        &["error: cannot write stdout"],
    );
}

#[cfg(target_os = "linux")]
#[test]
fn an_image_beyond_memory_is_refused_before_any_work() {
    let folder = Folder::new();
    let limited = |arguments: &str| {
        let words = format!("{arguments} --backend cpu --threads 1 --spp 1 -o r.npy");
        let mut command = Command::new("sh");
        command
            .args(["-c", "ulimit -v 4000000 && exec \"$0\" \"$@\""])
            .arg(env!("CARGO_BIN_EXE_gpu-trace"))
            .args(words.split_whitespace())
            .current_dir(folder.path(""));
        Run::new(command.output().expect("a shell"))
    };
    let run = limited("--size 65536x65536");
    assert_eq!(run.code, Some(2), "{run:?}");
    // 208 bytes a pixel, on any device.
    holds(
        &run.stderr,
        &["error: 65536x65536 pixels need 832 GiB", "--crop"],
    );
    assert_eq!(folder.names(), [""; 0]);
    let run = limited("--size 65536x65536 --crop 40000,30000,8x8");
    assert_eq!(run.code, Some(0), "{run:?}");
}

#[test]
fn results_go_down_a_pipe() {
    let folder = Folder::new();
    let text = folder.ok("--size 4x4 --spp 1 -q --stats /dev/stdout -o r.npy");
    let stats: serde_json::Value = serde_json::from_str(&text).expect("JSON alone");
    assert_eq!(stats["spp"], json!(1));
}
