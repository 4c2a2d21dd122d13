//! Dumps of several styles, boxes and timesteps.

use glam::DVec3;

use crate::particles::{Element, Format, Particles, Place, count_frames, parse};

fn read(text: &str, frame: u64) -> Particles {
    parse(text.as_bytes(), Format::LammpsDump, frame).unwrap_or_else(|m| panic!("{m}"))
}

/// A dump of one timestep.
fn dump(bounds: &str, columns: &str, rows: &[&str]) -> String {
    format!(
        "ITEM: TIMESTEP\n100\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS {bounds}\nITEM: ATOMS {columns} \n{}\n",
        rows.len(),
        rows.join(" \n")
    )
}

const CUBE: &str = "pp pp pp\n-1.0e+00 1.0e+00\n0 4\n0 8";

#[test]
fn columns_are_named_and_symbols_known() {
    let text = dump(
        CUBE,
        "id type element x y z diameter c_pe[1] mol_name",
        &["2 1 Si 0.5 1 2 3 -7.5 a", "1 2 X 1 2 3 4 nan b"],
    );
    let particles = read(&text, 0);
    let names: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
    let wanted = ["id", "type", "x", "y", "z", "diameter", "c_pe[1]", "radius"];
    assert_eq!(names, wanted);
    assert_eq!(particles.column("radius"), Some(&[1.5, 2.0][..]));
    assert!(particles.column("c_pe[1]").is_some_and(|c| c[1].is_nan()));
    assert_eq!(particles.positions[1], DVec3::new(1.0, 2.0, 3.0));
    let elements = particles.elements.expect("one is known");
    assert_eq!(elements[0].map(Element::symbol), Some("Si"));
    assert_eq!(elements[1], None);
    // A radius that is there stays.
    let text = dump(CUBE, "x y z diameter radius", &["0 0 0 4 1"]);
    assert_eq!(read(&text, 0).column("radius"), Some(&[1.0][..]));
}

#[test]
fn scaled_positions_become_lengths() {
    let text = dump(CUBE, "id xs ys zs", &["1 0 0.5 1", "2 1 0.25 0.5"]);
    let particles = read(&text, 0);
    let wanted = [DVec3::new(-1.0, 2.0, 8.0), DVec3::new(1.0, 1.0, 4.0)];
    assert_eq!(particles.positions, wanted);
    assert_eq!(particles.column("y"), Some(&[2.0, 1.0][..]));
    for columns in ["xu yu zu", "xsu ysu zsu ix"] {
        let text = dump(
            CUBE,
            columns,
            &[if columns.ends_with('x') {
                "2 2 2 0"
            } else {
                "3 8 16"
            }],
        );
        assert_eq!(read(&text, 0).positions, [DVec3::new(3.0, 8.0, 16.0)]);
    }
    // Of several sets, the first that is whole.
    let text = dump(CUBE, "xs ys zs x y z", &["0 0 0 1 2 3"]);
    assert_eq!(read(&text, 0).positions, [DVec3::new(1.0, 2.0, 3.0)]);
    let text = dump(CUBE, "x xu yu zu", &["0 1 2 3"]);
    assert_eq!(read(&text, 0).positions, [DVec3::new(1.0, 2.0, 3.0)]);
}

#[test]
fn tilted_boxes_are_unscaled() {
    // Edges (4, 0, 0), (-1, 3, 0), (0.5, -1, 2) from the origin (10, 20, 30): LAMMPS writes the bounds of all.
    let (xy, xz, yz): (f64, f64, f64) = (-1.0, 0.5, -1.0);
    let across = [0.0, xy, xz, xy + xz];
    let low = across.into_iter().fold(0.0, f64::min);
    let high = across.into_iter().fold(0.0, f64::max);
    let bounds = format!(
        "xy xz yz pp pp ff\n{} {} {xy}\n{} {} {xz}\n30 32 {yz}",
        10.0 + low,
        14.0 + high,
        20.0 + yz.min(0.0),
        23.0 + yz.max(0.0)
    );
    let rows = ["0 0 0", "1 0 0", "0 1 0", "0 0 1", "0.5 0.5 0.5"];
    let particles = read(&dump(&bounds, "xs ys zs", &rows), 0);
    let origin = DVec3::new(10.0, 20.0, 30.0);
    let edges = [
        DVec3::new(4.0, 0.0, 0.0),
        DVec3::new(-1.0, 3.0, 0.0),
        DVec3::new(0.5, -1.0, 2.0),
    ];
    let middle = origin + (edges[0] + edges[1] + edges[2]) / 2.0;
    let wanted = [
        origin,
        origin + edges[0],
        origin + edges[1],
        origin + edges[2],
        middle,
    ];
    // All these numbers have few binary digits.
    assert_eq!(particles.positions, wanted);
    // The same numbers mean something else in an upright box.
    let upright = "pp pp ff\n10 14\n20 23\n30 32";
    assert_ne!(read(&dump(upright, "xs ys zs", &rows), 0).positions, wanted);
}

#[test]
fn timesteps_are_frames() {
    let one = dump(CUBE, "x y z", &["1 0 0"]);
    let two = dump(CUBE, "id x y z", &["1 2 0 0", "2 3 0 0"]);
    let text = format!("ITEM: UNITS\nmetal\nITEM: TIME\n0.5\n{one}{two}");
    assert_eq!(read(&text, 0).positions[0].x, 1.0);
    assert_eq!(read(&text, 1).positions[1].x, 3.0);
    assert_eq!(count_frames(text.as_bytes(), Format::LammpsDump), Ok(2));
    let mistake = parse(text.as_bytes(), Format::LammpsDump, 2).expect_err("two frames");
    assert!(mistake.message.contains("2 frames, and no frame 2"));
}

#[test]
fn mistakes_have_their_line() {
    let count =
        |text: &str, count: &str| text.replacen("ATOMS\n1\n", &format!("ATOMS\n{count}\n"), 1);
    let good = dump(CUBE, "x y z", &["1 0 0"]);
    let scaled = dump(CUBE, "xs ys zs", &["1 0 0"]);
    for (text, line, wanted) in [
        (count(&good, "2"), 10, "wanted atom 2 of 2"),
        (count(&good, "99999999999999999"), 10, "ends here"),
        (count(&good, "0"), 10, "more than the 0 atoms"),
        (count(&good, "x"), 4, "wanted the number of atoms"),
        (
            good.replace("1 0 0", "1 0"),
            10,
            "has 2 values; `ITEM: ATOMS` names 3",
        ),
        (good.replace("1 0 0", "1 0 0 0"), 10, "has 4 values"),
        (good.replace("1 0 0", "1 inf 0"), 10, "not finite"),
        (good.replace("x y z", "x y"), 9, "positions are missing"),
        (good.replace("x y z", ""), 9, "positions are missing"),
        (
            good.replace("x y z", "x y z id id"),
            9,
            "two columns are named `id`",
        ),
        (
            good.replace("BOX BOUNDS", "WHAT"),
            5,
            "`WHAT pp pp pp` is not known",
        ),
        (good.replace("0 4", "0"), 7, "wanted 2 numbers"),
        (good.replace("0 4", "0 nan"), 7, "wanted 2 numbers"),
        (
            good.replace("pp pp pp", "xy xz yz pp pp pp"),
            6,
            "wanted 3 numbers",
        ),
        (
            good.replace("ITEM: NUMBER OF ATOMS\n1\n", ""),
            7,
            "before the atoms",
        ),
        (
            good.replace("TIMESTEP\n100", "TIMESTEP"),
            3,
            "wanted a line that begins",
        ),
        (
            scaled.replace("pp pp pp", "abc origin"),
            9,
            "no `ITEM: BOX BOUNDS`",
        ),
        (
            scaled.replace("0 8", "0 1e20").replace("1 0 0", "0 0 2"),
            10,
            "beyond 1e20",
        ),
        ("ITEM: TIMESTEP\n".into(), 1, "ends here"),
        (
            "C 0 0 0\n".into(),
            1,
            "wanted a line that begins with `ITEM:`",
        ),
    ] {
        let mistake = parse(text.as_bytes(), Format::LammpsDump, 0).expect_err(&text);
        assert!(mistake.to_string().contains(wanted), "{text}\n{mistake}");
        let Place::Line { number, .. } = &mistake.place else {
            panic!("{mistake}");
        };
        assert_eq!(*number, line, "{text}\n{mistake}");
    }
}
