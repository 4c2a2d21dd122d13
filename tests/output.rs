//! The files that a render leaves behind, through the public interface. No test relies on file
//! permissions to make a write fail: tests may run as root, whom they do not stop.

use std::fs;
use std::io::{self, Cursor, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use exr::prelude::{AttributeValue, ReadChannels, ReadLayers, Text};
use gpu_trace::error::Error;
use gpu_trace::output::{
    Contents, Format, Layer, Metadata, Picture, Progress, ProgressMode, Snapshot, Stats, Target,
    atomic, check_all, npy, png, read_npy, stats, write_all,
};
use proptest::prelude::*;
use tempfile::TempDir;

/// Values whose bits are easily lost: negative zero, subnormals, extremes, NaNs with a payload.
const DELICATE: [f32; 12] = [
    0.0,
    -0.0,
    1e-45,
    -1.1754942e-38,
    f32::MIN_POSITIVE,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::from_bits(0x7fc1_2345),
    1.0 / 3.0,
    16_777_217.0,
];

/// A picture of an odd size, higher than a block of EXR lines, that starts with the values above.
fn picture() -> Picture {
    let (width, height) = (7_u32, 19_u32);
    let mut values: Vec<f32> = (0..width * height * 3)
        .map(|i| (i as f32).sin() * 1e3)
        .collect();
    values[..DELICATE.len()].copy_from_slice(&DELICATE);
    Picture::new(width, height, values.as_chunks().0.to_vec())
}

fn bits(pixels: &[[f32; 3]]) -> Vec<u32> {
    pixels
        .as_flattened()
        .iter()
        .map(|value| value.to_bits())
        .collect()
}

fn contents<'a>(picture: &'a Picture, metadata: &'a Metadata) -> Contents<'a> {
    Contents {
        picture,
        layers: &[],
        metadata,
        exposure: 0.0,
    }
}

fn file_names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).expect("the directory can be listed");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// The text of a usage error, and that it is one.
fn usage<T: std::fmt::Debug>(result: Result<T, Error>) -> String {
    let error = result.expect_err("this should be refused");
    assert!(matches!(error, Error::Usage(_)), "{error:?}");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

// ---- Targets ----

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
    assert_eq!((*action, path), ("cannot write", &targets[0].path));
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
            assert_eq!((*action, named), ("cannot write", &path));
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
            .args(["--exact", "unix::a_full_disk_leaves_the_old_file"])
            .env(CHILD, &path)
            .output()
            .expect("a shell");
        assert!(child.status.success(), "{child:?}");
        assert_eq!(file_names(directory.path()), ["old.npy"]);
        assert_eq!(fs::read(&path).expect("a file"), b"old");
    }
}

// ---- PNG ----

#[test]
fn srgb_has_its_known_values() {
    for (linear, level) in [
        (-1.0, 0),
        (0.0, 0),
        (0.003_130_8, 10),
        (0.18, 118),
        (0.215_860_5, 128),
        (0.5, 188),
        (1.0, 255),
        (1.5, 255),
        (f32::MAX, 255),
    ] {
        assert_eq!(png::quantise([linear; 3], 1.0), [level; 3], "{linear}");
    }
    // Every level is the nearest to its own linear value, by the inverse function.
    for level in 0..=255_u8 {
        let display = f64::from(level) / 255.0;
        let linear = if display <= 0.040_45 {
            display / 12.92
        } else {
            ((display + 0.055) / 1.055).powf(2.4)
        };
        assert_eq!(png::quantise([linear as f32; 3], 1.0), [level; 3]);
    }
}

#[test]
fn values_that_are_no_numbers_are_seen() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(png::quantise([0.5, bad, 0.5], 1.0), [255, 0, 255]);
    }
}

#[test]
fn png_reads_back() {
    let picture = Picture::new(
        2,
        2,
        vec![[0.0; 3], [0.25; 3], [1.0, 0.125, 0.0], [f32::NAN; 3]],
    );
    for (scene, is_ascii) in [("room.toml", true), ("räume/部屋.toml", false)] {
        let metadata = Metadata::new().with("scene", scene).with("seed", u64::MAX);
        let bytes = png::encode(&picture, 1.0, &metadata).expect("a small picture");
        let decoder = ::png::Decoder::new(Cursor::new(bytes));
        let mut reader = decoder.read_info().expect("a header");
        let mut levels = [0; 12];
        reader.next_frame(&mut levels).expect("the image");
        reader.finish().expect("the end");
        assert_eq!(levels, [0, 0, 0, 188, 188, 188, 255, 137, 0, 255, 0, 255]);
        let info = reader.info();
        assert_eq!((info.width, info.height), (2, 2));
        assert!(info.srgb.is_some());
        let software = &info.uncompressed_latin1_text[0];
        assert_eq!(
            (software.keyword.as_str(), software.text.as_str()),
            ("Software", Metadata::SOFTWARE)
        );
        let comment = if is_ascii {
            info.uncompressed_latin1_text[1].text.clone()
        } else {
            info.utf8_text[0].get_text().expect("text")
        };
        assert_eq!(
            comment,
            format!("scene: {scene}\nseed: 18446744073709551615")
        );
    }
}

// ---- EXR ----

#[test]
fn exr_reads_back_bit_for_bit() {
    let picture = picture();
    let depth: Vec<f32> = (0..7 * 19).map(|index| index as f32 * 0.1).collect();
    let error: Vec<f32> = picture
        .pixels
        .as_flattened()
        .iter()
        .map(|value| value * 0.5)
        .collect();
    let layers = [
        Layer {
            name: "stderr",
            channels: &["R", "G", "B"],
            values: &error,
        },
        Layer {
            name: "depth",
            channels: &["Z"],
            values: &depth,
        },
    ];
    let metadata = Metadata::new()
        .with("scene", "部屋.toml")
        .with("seed", u64::MAX)
        .with("spp", 256_u64)
        .with("seconds", 12.5);
    let contents = Contents {
        layers: &layers,
        ..contents(&picture, &metadata)
    };
    let bytes = contents.encode(Format::Exr).expect("a small picture");

    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .expect("a valid file");
    let [layer] = image.layer_data.as_slice() else {
        panic!("one part")
    };
    assert_eq!((layer.size.0, layer.size.1), (7, 19));
    let channel = |name: &str| -> Vec<u32> {
        let found = layer
            .channel_data
            .list
            .iter()
            .find(|channel| channel.name.eq(name));
        let exr::prelude::FlatSamples::F32(values) = &found.expect(name).sample_data else {
            panic!("{name} is not f32")
        };
        values.iter().map(|value| value.to_bits()).collect()
    };
    let every_third = |values: &[f32], first: usize| -> Vec<u32> {
        values
            .iter()
            .skip(first)
            .step_by(3)
            .map(|value| value.to_bits())
            .collect()
    };
    let names: Vec<String> = layer
        .channel_data
        .list
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    assert_eq!(
        names,
        ["B", "G", "R", "depth.Z", "stderr.B", "stderr.G", "stderr.R"]
    );
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        assert_eq!(
            channel(name),
            every_third(picture.pixels.as_flattened(), index)
        );
        assert_eq!(
            channel(&format!("stderr.{name}")),
            every_third(&error, index)
        );
    }
    assert_eq!(
        channel("depth.Z"),
        depth
            .iter()
            .map(|value| value.to_bits())
            .collect::<Vec<_>>()
    );

    let software = layer
        .attributes
        .software_name
        .as_ref()
        .expect("the attribute");
    assert_eq!(software.as_slice(), Metadata::SOFTWARE.as_bytes());
    assert!(image.attributes.chromaticities.is_some());
    let utf8 = |text: &str| AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes()));
    for (name, value) in [
        ("gpu-trace:scene", utf8("部屋.toml")),
        ("gpu-trace:seed", utf8("18446744073709551615")),
        ("gpu-trace:spp", AttributeValue::I32(256)),
        ("gpu-trace:seconds", AttributeValue::F64(12.5)),
    ] {
        assert_eq!(
            layer.attributes.other.get(&Text::from(name)),
            Some(&value),
            "{name}"
        );
    }
}

#[test]
fn exr_refuses_layers_that_do_not_fit() {
    let picture = picture();
    let values = vec![0.0; 7 * 19];
    for layer in [
        Layer {
            name: "depth",
            channels: &["Z"],
            values: &values[1..],
        },
        Layer {
            name: "",
            channels: &["R"],
            values: &values,
        },
        Layer {
            name: "depth",
            channels: &[""],
            values: &values,
        },
    ] {
        let metadata = Metadata::new();
        let contents = Contents {
            layers: &[layer],
            ..contents(&picture, &metadata)
        };
        let error = contents.encode(Format::Exr).expect_err("it does not fit");
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
    }
}

// ---- NPY ----

/// An NPY file of version 1.0 with this header.
fn npy_file(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn npy_reads_back_bit_for_bit() {
    let directory = TempDir::new().expect("a directory");
    let path = directory.path().join("a.npy");
    let picture = picture();
    atomic::write(&path, &npy::encode(&picture)).expect("it can be written");
    let read = read_npy(&path).expect("a valid file");
    assert_eq!((read.width, read.height), (7, 19));
    assert_eq!(bits(&read.pixels), bits(&picture.pixels));
}

#[test]
fn npy_has_the_form_that_numpy_writes() {
    let bytes = npy::encode(&Picture::new(2, 1, vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]));
    let dictionary = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }";
    let expected = format!("{dictionary:117}\n");
    assert_eq!(&bytes[..128], npy_file(&expected, &[]));
    assert_eq!(bytes[128..132], 1.0_f32.to_le_bytes());
    assert_eq!(bytes.len(), 128 + 24);
}

#[test]
fn npy_takes_what_others_write() {
    let doubles: Vec<u8> = [0.1, 1e300, -2.0_f64]
        .into_iter()
        .flat_map(f64::to_le_bytes)
        .collect();
    let header = "{\"shape\":(1,1,3),'fortran_order':False , 'descr' : \"<f8\"}\n";
    let read = npy::decode(&npy_file(header, &doubles)[..]).expect("a valid file");
    assert_eq!(read.pixels, [[0.1, f32::INFINITY, -2.0]]);

    // Version 2.0 has four bytes of length.
    let mut bytes = npy::encode(&read);
    bytes[6] = 2;
    bytes.splice(8..10, 118_u32.to_le_bytes());
    assert_eq!(npy::decode(&bytes[..]).expect("a valid file"), read);
}

#[test]
fn corrupt_npy_is_refused_with_the_reason() {
    let good = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 3), }\n";
    npy::decode(&npy_file(good, &[0; 12])[..]).expect("this one is valid");
    let vary = |from: &str, to: &str| npy_file(&good.replace(from, to), &[0; 12]);
    for (bytes, reason) in [
        (Vec::new(), "within its header"),
        (b"\x89PNG\r\n\x1a\n".to_vec(), "not an NPY file"),
        (b"\x93NUMPY\x09\x00".to_vec(), "version 9.0"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(), "too long"),
        (b"\x93NUMPY\x01\x00\xff\xff{".to_vec(), "within its header"),
        (npy_file("\u{0}", &[]), "malformed"),
        (npy_file(good, &[0; 11]), "ends early"),
        (npy_file(good, &[0; 13]), "goes on"),
        (vary("<f4", "<i4"), "'<i4'; wanted"),
        (vary("<f4", ">f4"), "'>f4'; wanted"),
        (
            vary("'<f4'", "[('r', '<f4'), ('g', '<f4')]"),
            "wanted '<f4'",
        ),
        (vary("False", "True"), "Fortran order"),
        (vary("False", "Maybe"), "malformed"),
        (vary("(1, 1, 3)", "(1, 1, 4)"), "shape (1, 1, 4)"),
        (vary("(1, 1, 3)", "(3,)"), "shape (3,)"),
        (vary("(1, 1, 3)", "()"), "shape ()"),
        (vary("(1, 1, 3)", "(0, 1, 3)"), "shape (0, 1, 3)"),
        (vary("(1, 1, 3)", "(-1, 1, 3)"), "shape (-1, 1, 3)"),
        (
            vary("(1, 1, 3)", "(4294967295, 4294967295, 3)"),
            "ends early",
        ),
        (
            vary("(1, 1, 3)", "(99999999999, 1, 3)"),
            "shape (99999999999, 1, 3)",
        ),
        (vary("'shape'", "'descr'"), "malformed"),
        (vary("'shape'", "'share'"), "malformed"),
        (vary("'shape'", "'é"), "malformed"),
        (vary("}", ""), "malformed"),
    ] {
        let error = npy::decode(&bytes[..]).expect_err(reason);
        assert_eq!(error.kind(), io::ErrorKind::InvalidData, "{error}");
        assert!(
            error.to_string().contains(reason),
            "{error} does not say: {reason}"
        );
    }
    let missing = read_npy(Path::new("missing/a.npy")).expect_err("there is none");
    assert!(
        missing
            .to_string()
            .starts_with("cannot read missing/a.npy: "),
        "{missing}"
    );
}

proptest! {
    #[test]
    fn npy_survives_any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = npy::decode(&bytes[..]);
    }

    /// Headers of the pieces that the parser knows, in any order.
    #[test]
    fn npy_survives_any_header(
        pieces in prop::collection::vec(
            prop::sample::select(vec![
                "{", "}", "(", ")", "[", "'", "\"", ",", ":", " ", "\n", "é", "3", "1", "-",
                "'descr'", "'<f4'", "'<f8'", "'fortran_order'", "False", "'shape'", "(1, 1, 3)",
                "'descr': '<f4', ", "'fortran_order': False, ", "'shape': (2, 1, 3), ",
            ]),
            0..12,
        ),
        data in prop::collection::vec(any::<u8>(), 0..60),
    ) {
        let _ = npy::decode(&npy_file(&pieces.concat(), &data)[..]);
        let _ = npy::decode(&npy_file(&format!("{{{}}}", pieces.concat()), &data)[..]);
    }

    #[test]
    fn npy_survives_a_damaged_file(index in 0_usize..152, byte in any::<u8>(), end in 0_usize..153) {
        let mut bytes = npy::encode(&Picture::new(2, 1, vec![[1.0; 3]; 2]));
        bytes[index] = byte;
        bytes.truncate(end);
        let _ = npy::decode(&bytes[..]);
    }

    #[test]
    fn npy_keeps_all_bits(width in 1_u32..9, height in 1_u32..9, seed in any::<u32>()) {
        let values: Vec<[f32; 3]> = (0..width * height)
            .map(|i| [1, 2, 3].map(|c| f32::from_bits((seed ^ (3 * i + c)).wrapping_mul(0x9e37_79b9))))
            .collect();
        let picture = Picture::new(width, height, values);
        let read = npy::decode(&npy::encode(&picture)[..]).expect("a valid file");
        prop_assert_eq!((read.width, read.height), (width, height));
        prop_assert_eq!(bits(&read.pixels), bits(&picture.pixels));
    }
}

// ---- Statistics ----

fn statistics() -> Stats {
    Stats {
        version: "1.2.3".into(),
        scene: "room.toml".into(),
        scene_hash: "0123abcd".into(),
        seed: u64::MAX,
        sample_range: [16, 80],
        spp: 64,
        spp_range: [64, 64],
        pilot_spp: 0,
        width: 640,
        height: 480,
        backend: "gpu".into(),
        device: stats::Device {
            name: "Device".into(),
            ..Default::default()
        },
        effects: vec!["emission".into(), "mirror".into()],
        geometry: "baked".into(),
        integrator: "path".into(),
        sampler: "random".into(),
        max_bounces: 64,
        roulette: true,
        seconds: stats::Seconds {
            total: 2.5,
            setup: 0.25,
            compile: 0.25,
            render: 2.0,
            ledger: 0.0,
        },
        samples: 640 * 480 * 64,
        paths_per_second: f64::NAN,
        rays: 1 << 40,
        estimated_error: None,
        degrees_of_freedom: None,
        variance: stats::VarianceClass::HeavyTailed,
        black: false,
        non_finite: 0,
        first_non_finite: None,
        bounce_limit: stats::BounceLimit {
            throughput: f64::INFINITY,
            ..Default::default()
        },
        ledger: None,
        stopped_by: stats::StoppedBy::Interrupt,
        warnings: vec!["a \"quoted\"\nwarning".into()],
    }
}

#[test]
fn statistics_are_valid_json() {
    let directory = TempDir::new().expect("a directory");
    let path = directory.path().join("stats.json");
    statistics().write(&path).expect("it can be written");
    let text = fs::read_to_string(&path).expect("a file");
    assert!(text.ends_with("}\n"));
    let json: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    for name in [
        "scene",
        "scene_hash",
        "seed",
        "sample_range",
        "spp",
        "width",
        "height",
        "backend",
        "device",
        "effects",
        "integrator",
        "sampler",
        "seconds",
        "samples",
        "paths_per_second",
        "rays",
        "estimated_error",
        "spp_range",
        "pilot_spp",
        "degrees_of_freedom",
        "variance",
        "non_finite",
        "first_non_finite",
        "stopped_by",
        "version",
        "max_bounces",
        "roulette",
        "black",
        "bounce_limit",
        "ledger",
        "geometry",
        "warnings",
    ] {
        assert!(json.get(name).is_some(), "{name} is missing");
    }
    assert_eq!(json["seed"].as_u64(), Some(u64::MAX));
    assert_eq!(json["sample_range"], serde_json::json!([16, 80]));
    assert_eq!(json["stopped_by"], "interrupt");
    assert_eq!(json["variance"], "heavy-tailed");
    assert_eq!(json["seconds"]["total"], 2.5);
    for unknown in [
        &json["estimated_error"],
        &json["paths_per_second"],
        &json["bounce_limit"]["throughput"],
    ] {
        assert!(unknown.is_null());
    }
    let error = statistics().write(&directory.path().join("missing/stats.json"));
    assert!(matches!(
        error,
        Err(Error::File {
            action: "cannot write",
            ..
        })
    ));
}

#[test]
fn images_hold_what_the_statistics_say() {
    let metadata = statistics().metadata().to_string();
    for line in [
        "scene: room.toml",
        "seed: 18446744073709551615",
        "sample_range: 16..80",
        "seconds: 2.5",
    ] {
        assert!(metadata.lines().any(|found| found == line), "{metadata}");
    }
}

// ---- Progress ----

#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("no writer panics").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What a short render writes: two updates, a message and a warning between them.
fn progress_lines(mode: ProgressMode, quiet: bool) -> Vec<String> {
    let lines = Lines::default();
    let progress = Progress::to_writer(mode, quiet, lines.clone());
    let snapshot = Snapshot {
        samples: 1_000_000,
        spp: 64,
        spp_total: Some(256),
        fraction: 0.25,
        elapsed: Duration::from_millis(12_000),
        remaining: Some(Duration::from_secs(3661)),
        paths_per_second: 14.23e6,
        error: Some(0.0134),
    };
    progress.update(&snapshot);
    progress.message("hello");
    progress.warning("careful");
    progress.update(&Snapshot {
        fraction: 1.0,
        remaining: None,
        error: None,
        ..snapshot
    });
    drop(progress);
    let bytes = lines.0.lock().expect("no writer panics").clone();
    String::from_utf8(bytes)
        .expect("text")
        .lines()
        .map(str::to_owned)
        .collect()
}

#[test]
fn plain_progress_is_spaced_out() {
    let last = "100 %  64/256 spp  0:12  14.2 Mpaths/s";
    assert_eq!(
        progress_lines(ProgressMode::Plain, false),
        ["hello", "warning: careful", last]
    );
    assert_eq!(
        progress_lines(ProgressMode::Plain, true),
        ["warning: careful", last]
    );
}

#[test]
fn without_a_terminal_there_are_only_messages() {
    for mode in [ProgressMode::Auto, ProgressMode::None] {
        assert_eq!(progress_lines(mode, false), ["hello", "warning: careful"]);
        assert_eq!(progress_lines(mode, true), ["warning: careful"]);
    }
}

#[test]
fn json_progress_is_an_object_a_line() {
    let lines = progress_lines(ProgressMode::Json, false);
    let json: Vec<serde_json::Value> = lines
        .iter()
        .map(|line| serde_json::from_str(line).expect("valid JSON"))
        .collect();
    let kinds: Vec<&str> = json
        .iter()
        .filter_map(|line| line["type"].as_str())
        .collect();
    assert_eq!(kinds, ["progress", "message", "warning", "progress"]);
    assert_eq!(
        json[0],
        serde_json::json!({
            "type": "progress", "samples": 1_000_000, "spp": 64, "spp_total": 256, "fraction": 0.25,
            "elapsed": 12.0, "remaining": 3661.0, "paths_per_second": 14.23e6, "error": 0.0134,
        })
    );
    assert_eq!(json[1]["text"], "hello");
    assert!(json[3]["remaining"].is_null() && json[3]["error"].is_null());
}

#[test]
fn a_snapshot_reads_well() {
    let snapshot = Snapshot {
        spp: 4096,
        spp_total: Some(65536),
        elapsed: Duration::from_millis(59_600),
        remaining: Some(Duration::from_secs(3661)),
        paths_per_second: 1_234_567_890.0,
        error: Some(0.000_123),
        ..Snapshot::default()
    };
    assert_eq!(
        snapshot.to_string(),
        "4096/65536 spp  1:00, 1:01:01 left  1235 Mpaths/s  error 0.012 %"
    );
    let start = Snapshot {
        spp_total: Some(64),
        error: Some(f64::INFINITY),
        ..Snapshot::default()
    };
    assert_eq!(start.to_string(), "0/64 spp  0:00  0 Mpaths/s  error inf %");
    let without_end = Snapshot {
        spp: 7,
        ..Snapshot::default()
    };
    assert_eq!(without_end.to_string(), "7 spp  0:00  0 Mpaths/s");
}
