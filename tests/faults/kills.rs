//! Processes that are killed while they write.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use gpu_trace::image::{Format, Picture};
use gpu_trace::output::{Contents, Metadata, atomic};
use gpu_trace::verify::Random;

use super::temporaries;
use crate::cli_support::{Background, Folder, full_name};

/// A picture that does not compress.
fn noise(name: &str) -> Picture {
    let (width, height) = (600, 400);
    let mut random = Random::new(name);
    let pixels = (0..width * height).map(|_| {
        let [r, g, b, _] = random.unit4();
        [r, g, b]
    });
    Picture::new(width, height, pixels.collect())
}

/// Set in a process that only writes, until it is killed: the folder, and how to write.
const WRITER: [&str; 2] = ["GPU_TRACE_TEST_WRITER", "GPU_TRACE_TEST_WRITER_IN_PLACE"];
const FORMATS: [(&str, Format); 3] = [
    ("r.exr", Format::Exr),
    ("r.npy", Format::Npy),
    ("r.png", Format::Png),
];

/// Writes two versions of all files in turn, for ever.
fn write_for_ever(folder: &Path, in_place: bool) {
    let read = |name: String| fs::read(folder.join("versions").join(name)).expect("a file");
    let versions = FORMATS.map(|(name, _)| {
        let path = folder.join(name);
        (path, [read(format!("0{name}")), read(format!("1{name}"))])
    });
    for version in (0..2).cycle() {
        for (path, bytes) in &versions {
            if in_place {
                fs::write(path, &bytes[version]).expect("it can be written");
            } else {
                atomic::write(path, &bytes[version]).expect("it can be written");
            }
        }
        fs::write(folder.join("started"), "").expect("it can be written");
    }
}

/// What became of the files of writers that were killed at random moments.
#[derive(Debug, Default)]
struct Killed {
    /// Files that are neither version.
    torn: usize,
    /// Kills in the middle of a write, by what was left.
    halfway: usize,
    /// Files of the first and of the second version.
    versions: [usize; 2],
}

/// Kills at least `kills` writers, and more until `enough`.
fn kill_writers(
    test: &str,
    in_place: bool,
    kills: usize,
    enough: impl Fn(&Killed) -> bool,
) -> Killed {
    let folder = Folder::new();
    fs::create_dir(folder.path("versions")).expect("a folder");
    let metadata = Metadata::new();
    for version in ["0", "1"] {
        let picture = noise(version);
        let contents = Contents {
            picture: &picture,
            layers: &[],
            metadata: &metadata,
            exposure: 0.0,
        };
        for (name, format) in FORMATS {
            let bytes = contents.encode(format).expect("it can be encoded");
            folder.write(&format!("versions/{version}{name}"), bytes);
        }
    }
    let versions = FORMATS.map(|(name, _)| {
        ["0", "1"].map(|version| folder.read(&format!("versions/{version}{name}")))
    });
    let mut random = Random::new(test);
    let mut killed = Killed::default();
    for kill in 0.. {
        // One that never is enough fails below.
        if kill >= kills && (enough(&killed) || kill >= 20 * kills) {
            break;
        }
        let mut command = Command::new(std::env::current_exe().expect("the test's own path"));
        command
            .args(["--exact", &full_name(module_path!(), test)])
            .env(WRITER[0], folder.path(""))
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        if in_place {
            command.env(WRITER[1], "1");
        }
        let mut child = command.spawn().expect("the test starts again");
        let deadline = Instant::now() + Duration::from_secs(60);
        while !folder.path("started").exists() {
            assert!(Instant::now() < deadline, "the writer does not start");
            sleep(Duration::from_millis(1));
        }
        sleep(Duration::from_micros(random.range(0.0, 20_000.0) as u64));
        child.kill().expect("it runs");
        child.wait().expect("it has ended");
        fs::remove_file(folder.path("started")).expect("a file");
        for ((name, _), versions) in FORMATS.iter().zip(&versions) {
            let bytes = folder.read(name);
            match versions.iter().position(|version| *version == bytes) {
                Some(version) => killed.versions[version] += 1,
                None => killed.torn += 1,
            }
        }
        let left = temporaries(&folder.path(""));
        assert!(left.len() <= 1, "one process leaves {left:?}");
        for path in left {
            killed.halfway += 1;
            fs::remove_file(path).expect("a file");
        }
    }
    killed
}

/// Whether this process is a writer; it then never returns.
fn is_writer() {
    if let Some(folder) = std::env::var_os(WRITER[0]) {
        write_for_ever(Path::new(&folder), std::env::var_os(WRITER[1]).is_some());
    }
}

#[test]
fn a_kill_leaves_whole_files() {
    is_writer();
    let killed = kill_writers("a_kill_leaves_whole_files", false, 100, |killed| {
        killed.halfway >= 5
    });
    eprintln!("{killed:?}");
    assert_eq!(killed.torn, 0, "{killed:?}");
    // Else nothing was tried.
    assert!(killed.halfway >= 5, "{killed:?}");
    assert!(killed.versions.iter().all(|count| *count > 0), "{killed:?}");
}

/// The companion: files that are written in place do not survive this.
#[test]
fn a_kill_tears_files_that_are_written_in_place() {
    is_writer();
    let test = "a_kill_tears_files_that_are_written_in_place";
    let killed = kill_writers(test, true, 10, |killed| killed.torn > 0);
    eprintln!("{killed:?}");
    assert!(killed.torn > 0, "{killed:?}");
}

/// The same of the program, killed as soon as it begins to write.
#[test]
fn a_killed_render_leaves_whole_files() {
    let folder = Folder::new();
    let arguments = "lecture --size 800x600 --spp 1 -q -o r.npy -o r.exr -o r.png";
    let versions: [Picture; 2] = [0, 1].map(|seed| {
        folder.ok(&format!("{arguments} --seed {seed}"));
        folder.npy("r.npy")
    });
    let mut random = Random::new("kill");
    let mut left = 0;
    for seed in [0, 1, 0, 1, 0, 1] {
        let mut run = Background::start(&folder, &format!("{arguments} --seed {seed}"));
        while run.runs() && temporaries(&folder.path("")).is_empty() {
            sleep(Duration::from_micros(100));
        }
        sleep(Duration::from_micros(random.range(0.0, 10_000.0) as u64));
        drop(run);
        let picture = folder.npy("r.npy");
        assert!(versions.contains(&picture));
        assert!(image::open(folder.path("r.png")).is_ok());
        let exr = exr::prelude::read_first_flat_layer_from_file(folder.path("r.exr"));
        assert!(exr.is_ok(), "{exr:?}");
        let temporaries = temporaries(&folder.path(""));
        assert!(temporaries.len() <= 1, "{temporaries:?}");
        for path in temporaries {
            left += 1;
            fs::remove_file(path).expect("a file");
        }
    }
    eprintln!("{left} of 6 were killed in the middle of a write");
}
