//! Files that are damaged before they are read.

use std::fs;
use std::io;
use std::path::Path;

use gpu_trace::error::Error;
use gpu_trace::image::Picture;
use gpu_trace::input::{self, decode};
use gpu_trace::output::npy;
use gpu_trace::scene::load::{load_file, load_str};

use crate::cli_support::{Folder, holds};

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
