//! NPY as others write it.

use std::io;
use std::path::Path;

use ::exr::prelude::f16;
use gpu_trace::image::Picture;
use gpu_trace::input::decode;
use gpu_trace::output::npy;
use proptest::prelude::*;

use super::{HEIGHT, WIDTH, picture, read, refused, truncated_is_refused, value};

/// An NPY file of version 1.0 with this header.
fn npy_file(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// An NPY file as NumPy writes it.
fn array(descr: &str, fortran: &str, shape: &str, data: Vec<u8>) -> Vec<u8> {
    let header =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    npy_file(&header, &data)
}

#[test]
fn npy_of_every_kind() {
    assert_eq!(read(&npy::encode(&picture())).picture, picture());
    let all: Vec<f32> = picture().pixels.as_flattened().to_vec();
    let shape = "(5, 7, 3)";
    let of = |bytes: fn(f32) -> Vec<u8>| all.iter().copied().flat_map(bytes).collect::<Vec<u8>>();
    for (descr, data) in [
        ("<f2", of(|v| f16::from_f32(v).to_le_bytes().into())),
        (">f2", of(|v| f16::from_f32(v).to_be_bytes().into())),
        (">f4", of(|v| v.to_be_bytes().into())),
        ("<f8", of(|v| f64::from(v).to_le_bytes().into())),
        (">f8", of(|v| f64::from(v).to_be_bytes().into())),
    ] {
        let bytes = array(descr, "False", shape, data);
        assert_eq!(read(&bytes).picture, picture(), "{descr}");
        truncated_is_refused(descr, &bytes);
    }
    // Fortran order: rows run fastest, then columns.
    let mut data = Vec::new();
    for channel in 0..3 {
        for x in 0..WIDTH {
            data.extend((0..HEIGHT).flat_map(|y| value(x, y, channel).to_le_bytes()));
        }
    }
    assert_eq!(read(&array("<f4", "True", shape, data)).picture, picture());
    let grey: Vec<u8> = [0.25_f32, 4.0]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .collect();
    for shape in ["(1, 2)", "(1, 2, 1)"] {
        let input = read(&array("<f4", "False", shape, grey.clone()));
        assert_eq!(input.picture.pixels, [[0.25; 3], [4.0; 3]]);
    }
    let four: Vec<u8> = [1.0_f32, 2.0, 3.0, 0.5]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .collect();
    let input = read(&array("<f4", "False", "(1, 1, 4)", four));
    assert_eq!(input.picture.pixels, [[1.0, 2.0, 3.0]]);
    assert!(
        input.notes[0].contains("fourth channel"),
        "{:?}",
        input.notes
    );

    for (descr, shape, said) in [
        ("|u1", "(1, 2, 3)", "floats of 2, 4 or 8 bytes"),
        ("<c8", "(1, 2, 3)", "floats of 2, 4 or 8 bytes"),
        ("<f4", "(1, 2, 2)", "shape (1, 2, 2)"),
        ("<f4", "(6,)", "shape (6,)"),
        ("<f4", "(0, 2, 3)", "shape (0, 2, 3)"),
        ("<f4", "(1, 3, 3)", "ends early"),
        ("<f4", "(4294967295, 4294967295)", "ends early"),
    ] {
        let text = refused(&array(descr, "False", shape, vec![0; 24]));
        assert!(text.contains(said), "{text}");
    }
}

#[test]
fn npy_takes_what_others_write() {
    let doubles: Vec<u8> = [0.1, 1e300, -2.0_f64]
        .into_iter()
        .flat_map(f64::to_le_bytes)
        .collect();
    let header = "{\"shape\":(1,1,3),'fortran_order':False , 'descr' : \"<f8\"}\n";
    let picture = read(&npy_file(header, &doubles)).picture;
    assert_eq!(picture.pixels, [[0.1, f32::INFINITY, -2.0]]);

    // Version 2.0 has four bytes of length.
    let mut bytes = npy::encode(&picture);
    bytes[6] = 2;
    bytes.splice(8..10, 118_u32.to_le_bytes());
    assert_eq!(read(&bytes).picture, picture);
}

#[test]
fn corrupt_npy_is_refused_with_the_reason() {
    let good = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 3), }\n";
    read(&npy_file(good, &[0; 12]));
    let vary = |from: &str, to: &str| npy_file(&good.replace(from, to), &[0; 12]);
    for (bytes, reason) in [
        (b"\x93NUMPY".to_vec(), "within its header"),
        (b"\x93NUMPY\x09\x00".to_vec(), "version 9.0"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(), "too long"),
        (b"\x93NUMPY\x01\x00\xff\xff{".to_vec(), "within its header"),
        (npy_file("\u{0}", &[]), "malformed"),
        (npy_file(good, &[0; 11]), "ends early"),
        (npy_file(good, &[0; 13]), "goes on"),
        (vary("<f4", "<i4"), "'<i4'; wanted"),
        (
            vary("'<f4'", "[('r', '<f4'), ('g', '<f4')]"),
            "wanted floats",
        ),
        (vary("False", "Maybe"), "malformed"),
        (vary("(1, 1, 3)", "(1, 1, 5)"), "shape (1, 1, 5)"),
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
        let error = decode(&bytes).expect_err(reason);
        assert_eq!(error.kind(), io::ErrorKind::InvalidData, "{error}");
        assert!(
            error.to_string().contains(reason),
            "{error} does not say: {reason}"
        );
    }
    let missing = gpu_trace::input::read(Path::new("missing/a.npy")).expect_err("there is none");
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
        let _ = decode(&bytes);
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
        let _ = decode(&npy_file(&pieces.concat(), &data));
        let _ = decode(&npy_file(&format!("{{{}}}", pieces.concat()), &data));
    }

    #[test]
    fn npy_survives_a_damaged_file(index in 0_usize..152, byte in any::<u8>(), end in 0_usize..153) {
        let mut bytes = npy::encode(&Picture::new(2, 1, vec![[1.0; 3]; 2]));
        bytes[index] = byte;
        bytes.truncate(end);
        let _ = decode(&bytes);
    }
}
