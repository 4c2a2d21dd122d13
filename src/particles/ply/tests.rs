//! Text and both byte orders, with lists and elements that are left out.

use glam::DVec3;

use crate::particles::{Format, Particles, Place, parse};

fn read(bytes: &[u8]) -> Particles {
    parse(bytes, Format::Ply, 0).unwrap_or_else(|m| panic!("{m}"))
}

fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nobj_info 1\nelement camera 1\nproperty uchar a\n\
         property list uint8 int b\nelement none 7\nelement vertex 2\nproperty float x\nproperty double y\n\
         property short z\nproperty list uchar float tags\nproperty uchar red\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n"
    )
}

fn text() -> String {
    header("ascii").replace("element none 7\n", "")
        + "9 2 1 2\n1.5 2 -3 0 255\n4 5 6 2 0.5 0.5 7\n3 0 1 0\n"
}

fn binary(big: bool) -> Vec<u8> {
    let mut bytes = header(if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    })
    .into_bytes();
    let mut add = |value: &[u8]| {
        let mut value = value.to_vec();
        if big {
            value.reverse();
        }
        bytes.extend(value);
    };
    add(&[9]);
    add(&[2]);
    add(&1_i32.to_le_bytes());
    add(&2_i32.to_le_bytes());
    for (x, y, z, tags, red) in [
        (1.5_f32, 2.0_f64, -3_i16, 0_u8, 255_u8),
        (4.0, 5.0, 6, 2, 7),
    ] {
        add(&x.to_le_bytes());
        add(&y.to_le_bytes());
        add(&z.to_le_bytes());
        add(&[tags]);
        (0..tags).for_each(|_| add(&0.5_f32.to_le_bytes()));
        add(&[red]);
    }
    bytes.extend([3; 13]);
    bytes
}

#[test]
fn every_encoding_is_read() {
    let crlf = text().replace('\n', "\r\n");
    for bytes in [
        text().into_bytes(),
        crlf.into_bytes(),
        binary(false),
        binary(true),
    ] {
        let particles = read(&bytes);
        let wanted = [DVec3::new(1.5, 2.0, -3.0), DVec3::new(4.0, 5.0, 6.0)];
        assert_eq!(particles.positions, wanted);
        let names: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["x", "y", "z", "red"]);
        assert_eq!(particles.column("red"), Some(&[255.0, 7.0][..]));
    }
    // The wrong order is seen.
    let swapped = String::from_utf8_lossy(&binary(false)[..60]).contains("little");
    assert!(swapped);
    let mut bytes = binary(false);
    let head = header("binary_little_endian").len();
    bytes.splice(..head, header("binary_big_endian").into_bytes());
    assert!(parse(&bytes, Format::Ply, 0).map_or(true, |p| p != read(&binary(false))));
}

#[test]
fn mistakes_have_their_line() {
    for (change, line, wanted) in [
        (("ply\n", "plY\n"), 1, "begins with the line `ply`"),
        (("ascii 1.0", "ascii 2.0"), 2, "wanted ascii"),
        (("format ascii 1.0\n", ""), 15, "wanted `format`"),
        (
            ("element camera 1", "element camera -1"),
            5,
            "number of elements",
        ),
        (("element camera 1\n", ""), 5, "wanted `element`"),
        (("uchar a", "uchars a"), 6, "type `uchars`"),
        (("list uint8", "list float"), 7, "a whole type"),
        (("float x", "float x y"), 9, "wanted `property type name`"),
        (("float x", "float r"), 8, "no column `x`"),
        (("uchar red", "uchar x"), 8, "two columns"),
        (
            ("element vertex", "element vertices"),
            16,
            "without `element vertex`",
        ),
        (("end_header\n", "endheader\n"), 16, "`endheader`"),
        (("1.5 2 -3 0 255", "1.5 nan -3 0 255"), 18, "not finite"),
        (("1.5 2 -3 0 255", "1.5 2 -3 0"), 18, "fewer values"),
        (("1.5 2 -3 0 255", "1.5 2 -3 0 255 9"), 18, "more values"),
        (
            ("1.5 2 -3 0 255", "1.5 2 -3 -1 255"),
            18,
            "length of a list",
        ),
        (("6 2 0.5 0.5 7", "6 99999999999 7"), 19, "fewer values"),
        (("element vertex 2", "element vertex 5"), 20, "fewer values"),
        (
            ("element vertex 2", "element vertex 99999999999999999"),
            20,
            "fewer values",
        ),
        (
            ("element camera 1", "element camera 99"),
            20,
            "wanted element `camera` 5 of 99",
        ),
        (
            (
                "element face 1\nproperty list uchar int vertex_indices\n",
                "",
            ),
            18,
            "goes on",
        ),
    ] {
        let (from, to) = change;
        let changed = text().replacen(from, to, 1);
        assert_ne!(changed, text(), "{from}");
        let mistake = parse(changed.as_bytes(), Format::Ply, 0).expect_err(&changed);
        assert!(mistake.to_string().contains(wanted), "{changed}\n{mistake}");
        let Place::Line { number, .. } = &mistake.place else {
            panic!("{mistake}");
        };
        assert_eq!(*number, line, "{changed}\n{mistake}");
    }
}

#[test]
fn mistakes_have_their_byte() {
    let good = binary(false);
    let start = header("binary_little_endian").len();
    // Up to the end of the vertices.
    for length in start..good.len() - 13 {
        let mistake = parse(&good[..length], Format::Ply, 0).expect_err("it ends early");
        assert_eq!(mistake.place, Place::Byte(length as u64), "{mistake}");
        assert!(
            mistake.message.contains("the file ends within element"),
            "{mistake}"
        );
    }
    let mut nan = good.clone();
    nan[start + 10..start + 14].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let mistake = parse(&nan, Format::Ply, 0).expect_err("infinite");
    assert_eq!(mistake.place, Place::Byte(start as u64 + 10));
    assert!(mistake.message.contains("in vertex 0"), "{mistake}");
    let text = String::from_utf8_lossy(&good[..start]).into_owned();
    for count in ["9", "18446744073709551615"] {
        for name in ["camera", "vertex"] {
            let lie = text.replacen(
                &format!("{name} {}", if name == "camera" { 1 } else { 2 }),
                &format!("{name} {count}"),
                1,
            );
            let bytes = [lie.as_bytes(), &good[start..]].concat();
            assert!(parse(&bytes, Format::Ply, 0).is_err(), "{lie}");
        }
    }
}
