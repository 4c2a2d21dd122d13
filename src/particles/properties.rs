//! What is written reads back as the same numbers, whatever they are.

use std::fmt::Write as _;

use glam::DVec3;
use proptest::prelude::*;

use super::table::LARGEST;
use super::{Format, Particles, npy, parse};

/// Positions and radii.
type Rows = Vec<[f64; 4]>;

/// Numbers of every magnitude that is allowed, and the outermost ones.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -100.0..100.0_f64,
        4 => prop::num::f64::ANY.prop_filter("allowed", |x| x.abs() <= LARGEST),
        1 => prop::sample::select(vec![0.0, -0.0, LARGEST, -LARGEST, 5e-324, 1.0]),
    ]
}

fn rows() -> impl Strategy<Value = Rows> {
    prop::collection::vec(prop::array::uniform4(coordinate()), 1..20)
}

fn lines(head: &str, rows: &Rows, line: impl Fn(&[f64; 4]) -> String) -> Vec<u8> {
    let mut text = head.to_owned();
    for row in rows {
        writeln!(text, "{}", line(row)).expect("a String takes everything");
    }
    text.into_bytes()
}

fn binary(rows: &Rows, big: bool) -> Vec<u8> {
    let bytes = |x: &f64| {
        if big {
            x.to_be_bytes()
        } else {
            x.to_le_bytes()
        }
    };
    rows.iter().flatten().flat_map(bytes).collect()
}

/// The rows in every format that has names for all of them.
fn files(rows: &Rows) -> Vec<(Format, Vec<u8>)> {
    let count = rows.len();
    // `{:?}` writes the shortest decimal that reads back as the same f64.
    let spaced = |[x, y, z, r]: &[f64; 4]| format!("{x:?} {y:?} {z:?} {r:?}");
    let extended = format!("{count}\nProperties=species:S:1:pos:R:3:radius:R:1\n");
    let dump = format!(
        "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\n\
         ITEM: ATOMS x y z radius\n"
    );
    let ply = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty double x\nproperty double y\n\
             property double z\nproperty double radius\nend_header\n"
        )
    };
    let ply_binary = |format: &str, big| [ply(format).as_bytes(), &binary(rows, big)].concat();
    let shape = format!("({count}, 4)");
    vec![
        (
            Format::Xyz,
            lines(&extended, rows, |row| format!("H {}", spaced(row))),
        ),
        (Format::LammpsDump, lines(&dump, rows, spaced)),
        (
            Format::Csv,
            lines("x,y,z,radius\n", rows, |row| spaced(row).replace(' ', ",")),
        ),
        (
            Format::Npy,
            npy::tests::file("<f8", false, &shape, &binary(rows, false)),
        ),
        (
            Format::Npy,
            npy::tests::file(">f8", false, &shape, &binary(rows, true)),
        ),
        (Format::Ply, lines(&ply("ascii"), rows, spaced)),
        (Format::Ply, ply_binary("binary_little_endian", false)),
        (Format::Ply, ply_binary("binary_big_endian", true)),
    ]
}

/// Whether these are the particles of the rows, bit by bit.
fn same(particles: &Particles, rows: &Rows) -> bool {
    let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|x| x.to_bits()).collect() };
    let column = |index: usize| -> Vec<f64> { rows.iter().map(|row| row[index]).collect() };
    let positions: Vec<DVec3> = rows.iter().map(|r| DVec3::new(r[0], r[1], r[2])).collect();
    let flat = |positions: &[DVec3]| {
        bits(
            &positions
                .iter()
                .flat_map(DVec3::to_array)
                .collect::<Vec<_>>(),
        )
    };
    flat(&particles.positions) == flat(&positions)
        && ["x", "y", "z", "radius"]
            .iter()
            .enumerate()
            .all(|(index, name)| particles.column(name).map(bits) == Some(bits(&column(index))))
}

proptest! {
    #[test]
    fn what_is_written_reads_back(rows in rows()) {
        let mut other = rows.clone();
        other[0][3] += other[0][3].abs().max(1.0);
        for (format, bytes) in files(&rows) {
            let particles = parse(&bytes, format, 0);
            let particles = particles.map_err(|m| TestCaseError::fail(format!("{format:?}: {m}")))?;
            prop_assert!(same(&particles, &rows), "{format:?}");
            prop_assert!(!same(&particles, &other), "{format:?}");
        }
    }

    #[test]
    fn frames_of_xyz_are_told_apart(all in prop::collection::vec(rows(), 1..5)) {
        let frames = all.iter().map(|rows| files(rows).swap_remove(0).1);
        let bytes = frames.collect::<Vec<_>>().concat();
        prop_assert_eq!(super::count_frames(&bytes, Format::Xyz), Ok(all.len() as u64));
        for (index, rows) in all.iter().enumerate() {
            let particles = parse(&bytes, Format::Xyz, index as u64);
            prop_assert!(particles.is_ok_and(|particles| same(&particles, rows)));
        }
    }
}
