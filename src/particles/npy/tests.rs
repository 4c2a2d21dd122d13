//! Arrays of every type and order.

use glam::DVec3;

use crate::particles::{Format, Place, parse};

/// A file with this header and data.
pub(in crate::particles) fn file(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn every_type_and_order_is_read() {
    let rows = [[1_i8, -2, 3, 4], [5, 6, -7, 8]];
    for descr in ["<f4", ">f4", "<f8", ">f8", "<i4", ">i4", "<i8", ">i8"] {
        for (width, fortran) in [(3, false), (4, false), (3, true), (4, true)] {
            let place = |k: usize| {
                if fortran {
                    (k % 2, k / 2)
                } else {
                    (k / width, k % width)
                }
            };
            let mut data = Vec::new();
            for (row, column) in (0..2 * width).map(place) {
                let value = rows[row][column];
                let mut bytes = match &descr[1..] {
                    "f4" => f32::from(value).to_le_bytes().to_vec(),
                    "f8" => f64::from(value).to_le_bytes().to_vec(),
                    "i4" => i32::from(value).to_le_bytes().to_vec(),
                    _ => i64::from(value).to_le_bytes().to_vec(),
                };
                if descr.starts_with('>') {
                    bytes.reverse();
                }
                data.extend(bytes);
            }
            let bytes = file(descr, fortran, &format!("(2, {width})"), &data);
            let particles = parse(&bytes, Format::Npy, 0).unwrap_or_else(|m| panic!("{m}"));
            let wanted = [DVec3::new(1.0, -2.0, 3.0), DVec3::new(5.0, 6.0, -7.0)];
            assert_eq!(particles.positions, wanted, "{descr} {width} {fortran}");
            let radius = (width == 4).then_some(&[4.0, 8.0][..]);
            assert_eq!(particles.column("radius"), radius);
        }
    }
}

#[test]
fn mistakes_have_their_byte() {
    let good = file("<f4", false, "(1, 3)", &[0; 12]);
    let start = good.len() - 12;
    let mut nan = good.clone();
    nan[start + 4..start + 8].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut far = good.clone();
    far[start + 8..].copy_from_slice(&1.1e20_f32.to_le_bytes());
    for (bytes, byte, wanted) in [
        (b"x,y,z\n1,2,3\n".to_vec(), 0, "begins with"),
        (good[..20].to_vec(), 6, "ends within its header"),
        (
            good[..good.len() - 1].to_vec(),
            good.len() - 1,
            "3 values take 12",
        ),
        ([&good[..], b"\n"].concat(), good.len() + 1, "have 13 bytes"),
        (nan, start + 4, "not finite, in row 0"),
        (far, start + 8, "beyond 1e20"),
        (file("<f4", false, "(3,)", &[0; 12]), 6, "shape (3,)"),
        (file("<f4", false, "(1, 2)", &[0; 8]), 6, "shape (1, 2)"),
        (
            file("<c8", false, "(1, 3)", &[0; 24]),
            6,
            "values of type '<c8'",
        ),
        (
            file("<f8", false, "(4294967295, 4)", &[0; 32]),
            90,
            "take 137438953440",
        ),
        (file("<f8", true, "(4294967296, 4)", &[0; 32]), 6, "shape"),
    ] {
        let mistake = parse(&bytes, Format::Npy, 0).expect_err(wanted);
        assert!(mistake.to_string().contains(wanted), "{mistake}");
        let Place::Byte(found) = mistake.place else {
            panic!("{mistake}");
        };
        // The length of the header is not the point.
        assert!(found == byte as u64 || byte == 90, "{mistake}");
    }
}
