//! Where files go, and that they go there whole.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::cli_support::full_name;
use gpu_trace::error::{Action, Error};
use gpu_trace::image::Format;
use gpu_trace::output::{Metadata, Target, atomic, check_all, write_all};
use tempfile::TempDir;

use super::{contents, file_names, picture, usage};

#[test]
fn the_extension_names_the_format() {
    for (path, format) in [
        ("a.png", Format::Png),
        ("b/c.EXR", Format::Exr),
        ("x.y.Npy", Format::Npy),
    ] {
        let target = Target::parse(path).expect("a known extension");
        assert_eq!(
            (target.path.as_path(), target.format),
            (Path::new(path), format)
        );
    }
    for path in ["a.jpg", "a", "png", ".png", "", "a.png.", "a/b.png/.."] {
        let text = usage(Target::parse(path));
        assert!(text.contains(".png, .exr or .npy"), "{text}");
    }
}

#[test]
fn a_check_changes_nothing() {
    let directory = TempDir::new().expect("a directory");
    let existing = directory.path().join("old.npy");
    fs::write(&existing, "old").expect("a file");
    let modified = fs::metadata(&existing)
        .and_then(|data| data.modified())
        .expect("a time");
    let new = directory.path().join("new.png");
    check_all(&[&existing, &new], &[]).expect("both can be written");
    assert_eq!(file_names(directory.path()), ["old.npy"]);
    assert_eq!(fs::read(&existing).expect("a file"), b"old");
    assert_eq!(
        fs::metadata(&existing)
            .and_then(|data| data.modified())
            .expect("a time"),
        modified
    );
}

#[test]
fn outputs_that_cannot_be_written_are_refused() {
    let directory = TempDir::new().expect("a directory");
    let file = directory.path().join("file");
    fs::write(&file, "").expect("a file");
    let folder = directory.path().join("folder.png");
    fs::create_dir(&folder).expect("a directory");
    let long = format!("{}.png", "x".repeat(300));
    for (path, reason) in [
        (directory.path().join("missing/a.png"), "does not exist"),
        (file.join("a.png"), "ot a directory"),
        (folder, "is a directory"),
        (directory.path().join("new.png/"), "is a directory"),
        (directory.path().join(long), "too long"),
    ] {
        let text = usage(Target::parse(&path).and_then(|target| target.check()));
        assert!(
            text.contains(reason) && text.contains(&path.display().to_string()),
            "{text}"
        );
    }
    assert_eq!(file_names(directory.path()), ["file", "folder.png"]);
}

#[test]
fn the_message_does_not_name_the_temporary_file() {
    // Nobody can create a file there, root included.
    if Path::new("/proc/self").exists() {
        let text = usage(Target::parse("/proc/a.png").and_then(|target| target.check()));
        assert!(
            text.contains("'/proc'") && !text.contains(".gpu-trace-"),
            "{text}"
        );
    }
}

#[test]
fn two_outputs_to_one_file_are_refused() {
    let directory = TempDir::new().expect("a directory");
    let plain = directory.path().join("a.png");
    let roundabout = directory.path().join(".").join("a.png");
    let other = directory.path().join("b.png");
    check_all(&[&plain, &other], &[]).expect("different files");
    let text = usage(check_all(&[&plain, &other, &roundabout], &[]));
    assert!(text.contains("the same file"), "{text}");
    fs::write(&plain, "").expect("a file");
    usage(check_all(&[&plain, &roundabout], &[]));
    let text = usage(check_all(&[&plain], &[&roundabout]));
    assert!(text.contains("replace the input"), "{text}");
}

// ---- Writing ----

#[test]
fn every_format_is_written_and_replaces_what_was_there() {
    let directory = TempDir::new().expect("a directory");
    let names = ["a.exr", "a.npy", "a.png"];
    let targets: Vec<Target> = names
        .iter()
        .map(|name| Target::parse(directory.path().join(name)).expect("a known extension"))
        .collect();
    fs::write(&targets[0].path, "old").expect("a file");
    let (picture, metadata) = (picture(), Metadata::new());
    write_all(&targets, &contents(&picture, &metadata)).expect("all can be written");
    assert_eq!(file_names(directory.path()), names);
    for (target, magic) in targets
        .iter()
        .zip([&b"\x76\x2f\x31\x01"[..], b"\x93NUMPY", b"\x89PNG"])
    {
        assert!(
            fs::read(&target.path).expect("a file").starts_with(magic),
            "{target}"
        );
    }
}

#[test]
fn one_failure_does_not_stop_the_others() {
    let directory = TempDir::new().expect("a directory");
    let paths = ["missing/a.png", "b.npy", "missing/c.exr"];
    let targets = paths.map(|path| Target::parse(directory.path().join(path)).expect("a target"));
    let (picture, metadata) = (picture(), Metadata::new());
    let error = write_all(&targets, &contents(&picture, &metadata)).expect_err("two must fail");
    let Error::File { action, path, .. } = &error else {
        panic!("{error:?}")
    };
    assert_eq!((*action, path), (Action::Write, &targets[0].path));
    let text = error.to_string();
    assert!(
        text.contains("a.png") && text.contains("c.exr") && !text.contains("b.npy"),
        "{text}"
    );
    assert_eq!(error.exit_code(), 1);
    assert_eq!(file_names(directory.path()), ["b.npy"]);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::process::Command;

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).expect("a file").permissions().mode() & 0o7777
    }

    #[test]
    fn permissions_are_those_of_any_file() {
        let directory = TempDir::new().expect("a directory");
        let ordinary = directory.path().join("ordinary");
        fs::write(&ordinary, "").expect("a file");
        let ours = directory.path().join("ours");
        atomic::write(&ours, b"new").expect("it can be written");
        assert_eq!(mode(&ours), mode(&ordinary));
        for kept in [0o600, 0o640, 0o666] {
            fs::set_permissions(&ours, fs::Permissions::from_mode(kept)).expect("a file of ours");
            atomic::write(&ours, b"newer").expect("it can be written");
            assert_eq!(mode(&ours), kept);
        }
    }

    #[test]
    fn symbolic_links_stay() {
        let directory = TempDir::new().expect("a directory");
        fs::create_dir(directory.path().join("real")).expect("a directory");
        let real = directory.path().join("real/a.npy");
        let link = directory.path().join("link.npy");
        symlink("real/a.npy", &link).expect("a link");
        usage(check_all(&[&link, &real], &[]));
        // First a link to nothing, then one to a file.
        for content in [&b"one"[..], b"two"] {
            check_all(&[&link], &[]).expect("it can be written");
            atomic::write(&link, content).expect("it can be written");
            assert!(link.is_symlink());
            assert_eq!(fs::read(&real).expect("a file"), content);
        }
        assert_eq!(file_names(&directory.path().join("real")), ["a.npy"]);
        usage(check_all(&[&link, &real], &[]));

        let cycle = directory.path().join("cycle.npy");
        symlink("cycle.npy", &cycle).expect("a link");
        usage(check_all(&[&cycle], &[]));
    }

    #[test]
    fn devices_are_written_to_and_not_replaced() {
        let directory = TempDir::new().expect("a directory");
        let null = Path::new("/dev/null");
        check_all(&[null, null], &[]).expect("a device takes any number of outputs");
        atomic::write(null, b"gone").expect("it takes everything");
        assert!(!fs::metadata(null).expect("a device").is_file());

        if Path::new("/dev/full").exists() {
            let full = directory.path().join("full.npy");
            symlink("/dev/full", &full).expect("a link");
            let error = atomic::write(&full, b"too much").expect_err("it takes nothing");
            let Error::File { source, .. } = &error else {
                panic!("{error:?}")
            };
            assert_eq!(source.kind(), io::ErrorKind::StorageFull);
            assert_eq!(file_names(directory.path()), ["full.npy"]);
            assert!(full.is_symlink());
        }
    }

    /// Files that cannot grow any more stand for a full disk: the test runs itself again under a
    /// limit on their size, whose signal is ignored so that the write fails instead.
    #[test]
    fn a_full_disk_leaves_the_old_file() {
        const CHILD: &str = "GPU_TRACE_TEST_FULL_DISK";
        if let Some(path) = std::env::var_os(CHILD) {
            let path = PathBuf::from(path);
            let error = atomic::write(&path, &[1; 1 << 20]).expect_err("it is over the limit");
            let Error::File {
                action,
                path: named,
                ..
            } = &error
            else {
                panic!("{error:?}")
            };
            assert_eq!((*action, named), (Action::Write, &path));
            assert!(!error.to_string().contains(".gpu-trace-"), "{error}");
            return;
        }
        let directory = TempDir::new().expect("a directory");
        let path = directory.path().join("old.npy");
        fs::write(&path, "old").expect("a file");
        // Through pipes: the limit would hold for a log file, too.
        let child = Command::new("sh")
            .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""])
            .arg(std::env::current_exe().expect("the test's own path"))
            .arg("--exact")
            .arg(full_name(module_path!(), "a_full_disk_leaves_the_old_file"))
            .env(CHILD, &path)
            .output()
            .expect("a shell");
        assert!(child.status.success(), "{child:?}");
        let shown = String::from_utf8_lossy(&child.stdout);
        assert!(shown.contains("1 passed"), "{shown}");
        assert_eq!(file_names(directory.path()), ["old.npy"]);
        assert_eq!(fs::read(&path).expect("a file"), b"old");
    }
}
