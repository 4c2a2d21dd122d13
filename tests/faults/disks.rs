//! Disks that fill up, folders that vanish or are closed.

use std::fs;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::Command;

use gpu_trace::image::Picture;
use gpu_trace::output::npy;
use serde_json::json;

use super::{limited, temporaries};
use crate::cli_support::{Background, Folder, Run, holds};

/// A part of a file that fits, and then no more: the disk fills in the middle of the write.
#[test]
fn a_disk_that_fills_up_leaves_the_old_files() {
    let folder = Folder::new();
    folder.write("r.npy", "old");
    folder.write("r.exr", "old");
    let arguments = "--size 64x64 --spp 1 -o r.npy -o r.exr -o r.png --stats r.json";
    let arguments = format!("{arguments} --backend cpu --threads 1 --crop 0,0,64x64");
    // Blocks have 512 or 1024 bytes.
    let run = limited(&folder, "ulimit -f 8", &arguments);
    assert_eq!(run.code, Some(1), "{run:?}");
    holds(
        &run.stderr,
        &["error: cannot write r.npy: File too large", "r.exr"],
    );
    assert_eq!(folder.read("r.npy"), b"old");
    assert_eq!(folder.read("r.exr"), b"old");
    assert_eq!(folder.json("r.json")["spp"], json!(1));
    assert_eq!(temporaries(&folder.path("")).len(), 0);
    let run = limited(&folder, "ulimit -f 800", &arguments);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(folder.npy("r.npy").pixels.len(), 4096);
}

#[test]
fn a_film_file_that_has_no_room_leaves_the_old_one() {
    let folder = Folder::new();
    let arguments = "--size 16x16 --backend cpu --threads 1 -o k.npy";
    folder.ok(&format!("{arguments} --spp 16 --checkpoint k.film"));
    let film = folder.read("k.film");
    let run = limited(
        &folder,
        "ulimit -f 16",
        "resume k.film --spp 300 --checkpoint-every 1ms",
    );
    assert_eq!(run.code, Some(1), "{run:?}");
    let [said, warned] =
        ["error", "warning"].map(|what| format!("{what}: cannot write k.film: File too large"));
    holds(&run.stderr, &[&said, &warned]);
    assert!(folder.read("k.film") == film);
    assert_eq!(temporaries(&folder.path("")).len(), 0);
    // The image has what is in no film file.
    let image = folder.read("k.npy");
    folder.ok("resume k.film --spp 300");
    assert_eq!(folder.read("k.npy"), image);
}

/// A file system of its own, where the system lets us mount one.
#[cfg(target_os = "linux")]
#[test]
fn a_small_file_system_keeps_the_old_file() {
    const NOT_PERMITTED: i32 = 77;
    // One picture of 49,280 bytes fits, but no second one.
    for (size, code) in [("80k", 1), ("1m", 0)] {
        let folder = Folder::new();
        fs::create_dir(folder.path("small")).expect("a folder");
        let picture = Picture::new(64, 64, vec![[0.5; 3]; 4096]);
        folder.write("old.npy", npy::encode(&picture));
        let script = format!(
            "mount -t tmpfs -o size={size} none small || exit {NOT_PERMITTED}
             cp old.npy small/r.npy
             \"$0\" --backend cpu --threads 1 --size 64x64 --spp 1 \
                 -o small/r.npy -o fine.npy --stats r.json
             code=$?
             cp small/* .
             ls -A small > list
             exit $code"
        );
        let output = Command::new("unshare")
            .args(["--map-root-user", "--mount", "sh", "-c", &script])
            .arg(env!("CARGO_BIN_EXE_gpu-trace"))
            .current_dir(folder.path(""))
            .output();
        let run = match output {
            Ok(output) if !folder.path("list").exists() => {
                eprintln!("SKIPPED: no file system can be mounted here: {output:?}");
                return;
            }
            Ok(output) => Run::new(output),
            Err(error) => {
                eprintln!("SKIPPED: no unshare: {error}");
                return;
            }
        };
        assert_eq!(run.code, Some(code), "{run:?}");
        assert_eq!(folder.read("list"), b"r.npy\n");
        assert_eq!(folder.npy("fine.npy").pixels.len(), 4096);
        assert_eq!(folder.json("r.json")["spp"], json!(1));
        let kept = folder.read("r.npy") == folder.read("old.npy");
        assert_eq!(kept, code == 1);
        if code == 1 {
            let text = "error: cannot write small/r.npy: No space left on device";
            holds(&run.stderr, &[text]);
        }
    }
}

/// Starts a render to `out/r.npy` and `fine.npy` by `command`, lets `change` happen in the middle,
/// and ends it.
fn with_change(mut command: Command, change: impl FnOnce()) -> Run {
    let arguments = "--backend cpu --threads 1 --size 8x8 --time 1h --progress json \
                     -o out/r.npy -o fine.npy --stats r.json";
    command.args(arguments.split_whitespace());
    let mut run = Background::of(command);
    run.wait_for("\"progress\"");
    change();
    run.signal("TERM");
    run.finish()
}

#[test]
fn an_output_folder_may_vanish() {
    type Change = fn(&Path);
    let changes: [(Change, &str); 4] = [
        (
            |out| fs::remove_dir_all(out).expect("a folder"),
            "No such file or directory",
        ),
        (
            |out| {
                fs::remove_dir_all(out).expect("a folder");
                fs::write(out, "file").expect("a file");
            },
            "Not a directory",
        ),
        (
            |out| fs::create_dir(out.join("r.npy")).expect("a folder"),
            "is a directory",
        ),
        (|_| {}, ""),
    ];
    for (change, reason) in changes {
        let folder = Folder::new();
        fs::create_dir(folder.path("out")).expect("a folder");
        let run = with_change(folder.command(""), || change(&folder.path("out")));
        if reason.is_empty() {
            assert_eq!((run.code, run.stdout.lines().count()), (Some(143), 1));
            assert_eq!(folder.npy("out/r.npy").pixels.len(), 64);
        } else {
            assert_eq!(run.code, Some(1), "{run:?}");
            holds(&run.stderr, &["error: cannot write out/r.npy", reason]);
        }
        // The rest is there, whatever became of one folder.
        assert_eq!(folder.npy("fine.npy").pixels.len(), 64);
        assert_eq!(folder.json("r.json")["stopped_by"], json!("interrupt"));
        assert_eq!(temporaries(&folder.path("")).len(), 0);
    }
}

#[test]
fn an_output_folder_may_lose_its_write_permission() {
    const NOBODY: u32 = 65_534;
    let folder = Folder::new();
    let out = folder.path("out");
    fs::create_dir(&out).expect("a folder");
    folder.write("out/r.npy", "old");
    let program = folder.path("program");
    fs::copy(env!("CARGO_BIN_EXE_gpu-trace"), &program).expect("a copy of the program");
    let mut command = Command::new(&program);
    command.current_dir(folder.path(""));
    // Permissions do not concern root.
    if fs::metadata(&out).expect("a folder").uid() == 0 {
        for path in ["", "out", "out/r.npy", "program"] {
            chown(folder.path(path), Some(NOBODY), Some(NOBODY)).expect("root may do so");
        }
        command.uid(NOBODY).gid(NOBODY);
    }
    let set =
        |mode| fs::set_permissions(&out, fs::Permissions::from_mode(mode)).expect("it is ours");
    let run = with_change(command, || set(0o555));
    set(0o755);
    assert_eq!(run.code, Some(1), "{run:?}");
    let text = "error: cannot write out/r.npy: Permission denied";
    holds(&run.stderr, &[text]);
    assert_eq!(folder.read("out/r.npy"), b"old");
    assert_eq!(temporaries(&out).len(), 0);
    assert_eq!(folder.npy("fine.npy").pixels.len(), 64);
    assert_eq!(folder.json("r.json")["stopped_by"], json!("interrupt"));
}
