//! What goes wrong while a render runs: samples that are not finite, devices that fail, memory and
//! disks that are full, folders that vanish, signals that end it at the worst moment.
#![cfg(unix)]

use std::fs;
use std::io;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::cli_support::{Background, Folder, Run, bits, full_name, holds};
use gpu_trace::error::Error;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::image::{Format, Picture};
use gpu_trace::input::{self, decode};
use gpu_trace::output::{Contents, Metadata, atomic, npy};
use gpu_trace::scene::load::{load_file, load_str};
use gpu_trace::settings::GeometryChoice;
use gpu_trace::verify::Random;
use serde_json::json;

/// On one thread, the first paths of this furnace take longer than any test; and it is small, so that they
/// begin at once.
const ENDLESS: &str = "
    camera = { position = [0, 0, 0], look_at = [0, 0, 1], fov = 40 }
    image = { width = 64, height = 64 }
    render = { max_bounces = 65535 }
    material.wall = { type = \"diffuse\", albedo = [1, 1, 1], emission = [1, 1, 1] }
    sphere = [{ center = [0, 0, 0], radius = 1, material = \"wall\" }]
";

/// What is left of a process that was killed while it wrote.
fn temporaries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder can be listed");
    entries
        .map(|entry| entry.expect("an entry of the folder").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "tmp"))
        .collect()
}

// ---- Samples that are not finite ----

#[test]
fn samples_that_are_not_finite_are_an_error_unless_allowed() {
    for backend in ["gpu", "cpu"] {
        let folder = Folder::new();
        let render = |more: &str| {
            let arguments = "--size 4x4 --crop 1,2,3x2 --spp 128 -o r.npy --stats r.json";
            folder.run(&format!("{arguments} --backend {backend} {more}"))
        };
        let place = "pixel (1, 2), sample 16, after bounce 1";
        let failed = render("--inject-fault non-finite@1");
        assert_eq!(failed.code, Some(1), "{failed:?}");
        holds(&failed.stdout, &["128 spp", "3 samples not finite", place]);
        holds(&failed.stderr, &["error: 3 samples", place, "--allow-non"]);
        let stats = folder.json("r.json");
        assert_eq!(stats["non_finite"], json!(3));
        let first = json!({ "pixel": [1, 2], "sample": 16, "bounce": 1 });
        assert_eq!(stats["first_non_finite"], first);
        let image = folder.read("r.npy");

        let allowed = render("--inject-fault non-finite@1 --allow-non-finite");
        assert_eq!(allowed.code, Some(0), "{allowed:?}");
        holds(&allowed.stdout, &["3 samples not finite", place]);
        holds(&allowed.stderr, &["warning: 3 samples were not", place]);
        let stats = folder.json("r.json");
        assert_eq!(stats["first_non_finite"], first);
        let warning = stats["warnings"][0].as_str().expect("a text");
        holds(warning, &["3 samples were not finite", place]);
        assert_eq!(folder.read("r.npy"), image);

        // Permission alone changes nothing, nor does a fault after the end.
        for clean in ["--allow-non-finite", "--inject-fault non-finite@3"] {
            let run = render(clean);
            assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");
            assert!(!run.stdout.contains("finite"), "{run:?}");
            let stats = folder.json("r.json");
            assert_eq!(stats["non_finite"], json!(0));
            assert!(stats["first_non_finite"].is_null(), "{stats}");
        }
    }
}

// ---- Devices ----

#[test]
fn a_device_that_fails_costs_no_sample_that_was_done() {
    for (fault, text) in [
        ("device-lost", "the device is lost"),
        ("out-of-memory", "the device is out of memory"),
    ] {
        let folder = Folder::new();
        let arguments = "--size 16x16 --spp 300 -o r.npy -o r.png --stats r.json";
        folder.write("r.npy", "old");
        let run = folder.run(&format!("{arguments} --inject-fault {fault}@2"));
        assert_eq!(run.code, Some(1), "{run:?}");
        holds(&run.stdout, &["r.npy, r.png: 16x16, 64 spp, failed"]);
        let saved = "the 64 samples a pixel done before are in r.npy, r.png";
        holds(&run.stderr, &["error: ", text, saved]);
        assert_eq!(run.stderr.lines().count(), 1, "{run:?}");
        assert_eq!(folder.names(), ["r.json", "r.npy", "r.png"]);
        let stats = folder.json("r.json");
        assert_eq!(stats["spp"], json!(64));
        assert_eq!(stats["samples"], json!(64 * 256));
        assert_eq!(stats["stopped_by"], json!("failure"));
        assert!(image::open(folder.path("r.png")).is_ok());
        let part = folder.npy("r.npy");
        let whole = folder.render("--size 16x16 --spp 64").0;
        assert_eq!(bits(&part), bits(&whole));

        // Nothing was done: what there was is better.
        let before = folder.snapshot();
        let run = folder.run(&format!("{arguments} --inject-fault {fault}@0"));
        assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""), "{run:?}");
        holds(&run.stderr, &["error: ", text, "no file was changed"]);
        assert_eq!(before, folder.snapshot());
    }
}

#[test]
fn a_device_and_a_disk_that_fail_are_both_reported() {
    let folder = Folder::new();
    fs::create_dir(folder.path("out")).expect("a folder");
    folder.write("out/r.npy", "old");
    // More than the limit lets through.
    let arguments =
        "--size 64x64 --spp 32 --inject-fault device-lost@1 -o out/r.npy --stats r.json";
    let run = limited(&folder, "ulimit -f 8", arguments);
    assert_eq!(run.code, Some(1), "{run:?}");
    holds(
        &run.stderr,
        &["the device is lost", "cannot write out/r.npy: File too"],
    );
    assert_eq!(folder.read("out/r.npy"), b"old");
    assert_eq!(folder.json("r.json")["spp"], json!(16));
}

#[test]
fn faults_are_for_those_who_know_them() {
    let folder = Folder::new();
    for wrong in ["", "lost@1", "device-lost", "device-lost@", "non-finite@-1"] {
        let text = folder.refused(&["--spp", "1", "--inject-fault", wrong]);
        holds(&text, &["KIND@WINDOW"]);
    }
    let text = folder.refused(&["--backend", "cpu", "--inject-fault", "device-lost@0"]);
    holds(&text, &["the CPU has no device"]);
    assert!(!folder.ok("--help").contains("inject"));
}

#[test]
fn a_scene_beyond_the_devices_limits_is_an_error() {
    let scene = crate::common::scene_file("scenes/glass.toml");
    let mut settings = gpu_trace::verify::settings(&scene, 64, 64, 1);
    settings.geometry = GeometryChoice::List;
    let job = crate::common::job(&scene, &settings);
    let with_at_most = |bytes: u64| {
        let mut gpu = crate::common::gpu();
        gpu.limits.max_storage_buffer_binding_size = bytes;
        GpuRenderer::new(gpu, &job)
    };
    for (bytes, part) in [(64, "need"), (4096, "the partial sums need")] {
        match with_at_most(bytes) {
            Err(Error::DeviceLimit(text)) => {
                let limit = format!("limit of {bytes} ");
                holds(&text, &[part, "bytes", &limit, "--backend cpu"]);
            }
            other => panic!("{bytes} bytes: {other:?}"),
        }
    }
    assert!(with_at_most(1 << 20).is_ok());
}

#[test]
fn a_scene_of_too_many_magnitudes_is_an_error() {
    let folder = Folder::new();
    let scene = |camera: &str, radius: &str| {
        format!(
            "camera = {{ {camera}, look_at = [0, 0, 0], fov = 40 }}
             image = {{ width = 4, height = 4 }}
             environment = {{ radiance = [1, 1, 1] }}
             material.a = {{ type = \"diffuse\", albedo = [1, 1, 1] }}
             sphere = [
                 {{ center = [3, 0, 0], radius = 1, material = \"a\" }},
                 {{ center = [0, 0, 0], radius = {radius}, material = \"a\" }},
             ]"
        )
    };
    let near = "position = [0, 0, -1]";
    let far = "position = [0, 0, -1e20]";
    let lens = "position = [0, 0, -1], aperture_radius = 1e-3, focus_distance = 1e-50";
    for (camera, radius, part) in [
        (near, "1e-61", "the radius of sphere 2 "),
        (near, "1e-300", "the radius of sphere 2 "),
        (lens, "0.1", "the camera's lens "),
    ] {
        folder.write("bad.toml", scene(camera, radius));
        for command in [&["effects", "bad.toml"][..], &["bad.toml", "-o", "r.npy"]] {
            holds(&folder.refused(command), &["error: ", part, "magnitude"]);
        }
    }
    let dark = scene(near, "0.1").replace("radiance = [1, 1, 1]", "radiance = [0, 1e-320, 0]");
    folder.write("bad.toml", dark);
    let text = folder.refused(&["bad.toml", "-o", "r.npy"]);
    holds(&text, &["error: the brightest light", "too dark"]);
    // What f32 holds is rendered.
    for (camera, radius) in [(near, "1e-37"), (far, "1e-10"), (near, "1")] {
        folder.write("good.toml", scene(camera, radius));
        folder.ok("good.toml --spp 1 -o r.npy");
    }
}

/// Runs the program under `limits`, shell commands.
fn limited(folder: &Folder, limits: &str, arguments: &str) -> Run {
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("{limits} && exec \"$0\" \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_gpu-trace"))
        .args(arguments.split_whitespace())
        .current_dir(folder.path(""));
    Run::new(command.output().expect("a shell"))
}

/// The driver's part of an address space is unknown; without one it ends well at any limit.
#[cfg(target_os = "linux")]
#[test]
fn with_little_memory_a_render_is_refused_or_done() {
    let folder = Folder::new();
    folder.write("r.npy", "old");
    // Nothing but sky, so that many limits can be tried.
    folder.write(
        "sky.toml",
        "camera = { position = [0, 0, 0], look_at = [0, 0, 1], fov = 40 }
         image = { width = 600, height = 600 }
         environment = { radiance = [1, 1, 1] }",
    );
    let arguments = "sky.toml --backend cpu --threads 1 --spp 1 -o r.npy -o r.exr -o r.png";
    let mut codes = Vec::new();
    // 360,000 pixels take 118 MB, and what does not depend on them 18 and more. In steps that are small
    // against the 64 MiB of address space that a thread's own heap would take at some moment.
    for megabytes in (60..=320).step_by(10) {
        let before = folder.snapshot();
        let run = limited(&folder, &format!("ulimit -v {megabytes}000"), arguments);
        match run.code {
            Some(2) => {
                let text = "error: 600x600 pixels need 0.";
                holds(&run.stderr, &[text, "GiB of memory", "--crop"]);
                assert_eq!(before, folder.snapshot());
            }
            code => assert_eq!(code, Some(0), "{megabytes} MB: {run:?}"),
        }
        codes.push(run.code);
    }
    assert!(codes.is_sorted_by(|a, b| a >= b), "{codes:?}");
    assert_eq!(
        (codes.first(), codes.last()),
        (Some(&Some(2)), Some(&Some(0)))
    );
}

// ---- Disks and folders ----

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

// ---- Signals ----

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

// ---- Files that are read ----

#[test]
fn a_damaged_npy_is_refused_or_read_as_it_is() {
    let picture = Picture::new(3, 2, vec![[0.25, 0.5, 1.0]; 6]);
    let whole = npy::encode(&picture);
    let folder = Folder::new();
    let read = |bytes: &[u8]| {
        folder.write("a.npy", bytes);
        input::read(&folder.path("a.npy")).map(|input| input.picture)
    };
    assert_eq!(read(&whole).expect("it is whole"), picture);
    for length in 0..whole.len() {
        match read(&whole[..length]) {
            Err(Error::File { source, .. }) => {
                assert_eq!(source.kind(), io::ErrorKind::InvalidData, "{length}");
                assert!(!source.to_string().is_empty());
            }
            other => panic!("{length} bytes: {other:?}"),
        }
    }
    let data = whole.len() - 72;
    for bit in 0..8 * whole.len() {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        // Another byte order is another array, and as good.
        if bytes[..data].windows(3).any(|w| w == b">f4") {
            continue;
        }
        match decode(&bytes).map(|input| input.picture) {
            // One value has one bit changed.
            Ok(damaged) if bit / 8 >= data => {
                assert_eq!(npy::encode(&damaged), bytes, "bit {bit}");
            }
            // What the header says in other words, or of the version's minor number.
            Ok(damaged) => assert_eq!(damaged, picture, "bit {bit}"),
            Err(error) => {
                assert!(bit / 8 < data, "bit {bit}: {error}");
                let text = error.to_string();
                assert!(!text.chars().any(char::is_control), "{text:?}");
            }
        }
    }
}

#[test]
fn a_damaged_scene_is_refused_with_its_place_or_loaded() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/glass.toml");
    let whole = fs::read_to_string(&path).expect("a scene");
    let refused = |result: Result<_, Error>, what: &str| match result {
        Ok(_) => 0,
        Err(Error::Scene(text)) => {
            assert!(text.starts_with("error: "), "{what}: {text}");
            let binary = text.contains("it holds binary data");
            assert!(binary || text.contains("a.toml:"), "{what}: {text}");
            1
        }
        Err(other) => panic!("{what}: {other}"),
    };
    let cut = (0..whole.len()).filter(|length| whole.is_char_boundary(*length));
    let cut = cut.map(|length| refused(load_str("a.toml", &whole[..length]), &length.to_string()));
    let (cut, all): (usize, usize) = cut.fold((0, 0), |(sum, n), x| (sum + x, n + 1));
    assert!(cut > all / 4 && cut < all, "{cut} of {all}");
    let folder = Folder::new();
    let mut flipped = 0;
    for bit in 0..8 * whole.len() {
        let mut bytes = whole.clone().into_bytes();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let loaded = match str::from_utf8(&bytes) {
            Ok(text) => load_str("a.toml", text),
            Err(_) => {
                folder.write("a.toml", &bytes);
                load_file(&folder.path("a.toml"))
            }
        };
        flipped += refused(loaded, &format!("bit {bit}"));
    }
    assert!(flipped > whole.len(), "{flipped}");
    // The program says the same, and leaves no trace.
    let line = whole.find("look_at").expect("a camera");
    folder.write("a.toml", &whole[..line + 12]);
    for arguments in [
        &["scene", "check", "a.toml"][..],
        &["a.toml", "-o", "r.npy"],
    ] {
        holds(&folder.refused(arguments), &["error: ", "a.toml:"]);
    }
}
