//! Records as they are in real files, with their quirks.

use glam::DVec3;

use crate::particles::{Element, Format, Particles, Place, count_frames, parse};

fn read(text: &str, frame: u64) -> Particles {
    parse(text.as_bytes(), Format::Pdb, frame).unwrap_or_else(|m| panic!("{m}"))
}

fn symbols(particles: &Particles) -> Vec<&'static str> {
    let elements = particles.elements.iter().flatten();
    elements.map(|e| e.map_or("-", Element::symbol)).collect()
}

const TWO: &str = "\
HEADER    TOXIN                                   26-JAN-96   1TII
ATOM      1  N   GLU A   4      69.319  39.142  47.221  1.00 64.20           N
ATOM      2  CA AGLU B   4      68.071  38.402  47.431  0.50  1.50           C1+
";

#[test]
fn columns_are_fixed() {
    let particles = read(TWO, 0);
    let wanted = [
        DVec3::new(69.319, 39.142, 47.221),
        DVec3::new(68.071, 38.402, 47.431),
    ];
    assert_eq!(particles.positions, wanted);
    assert_eq!(symbols(&particles), ["N", "C"]);
    for (name, values) in [
        ("serial", [1.0, 2.0]),
        ("chain", [0.0, 1.0]),
        ("residue", [4.0, 4.0]),
        ("z", [47.221, 47.431]),
        ("occupancy", [1.0, 0.5]),
        ("b_factor", [64.2, 1.5]),
    ] {
        assert_eq!(particles.column(name), Some(&values[..]), "{name}");
    }
}

#[test]
fn elements_come_from_names_where_their_columns_say_nothing() {
    for (line, symbol) in [
        // Nothing, the number of a line, a segment, capitals.
        (
            "ATOM      1  CA  GLY A   9       0.0     0.0     0.0    1.00 20.00",
            "C",
        ),
        (
            "HETATM 1685  PE  AP5 A 215      25.829  43.456  19.553  1.00 25.81      1AKE1839",
            "P",
        ),
        (
            "HETATM 1701 AC5  AP5 A 215      11.690  47.264  21.916  1.00 19.01      1AKE1855",
            "Ac",
        ),
        (
            "ATOM    265 HG22 ARG    16      -0.282   5.522   8.437  1.00  0.00      A   ",
            "H",
        ),
        (
            "ATOM    265 1HG2 ARG    16      -0.282   5.522   8.437  1.00  0.00",
            "H",
        ),
        (
            "ATOM    265 CA   ARG    16      -0.282   5.522   8.437",
            "C",
        ),
        (
            "HETATM  501 CA    CA A   9      23.592  -2.876  -3.597  1.00 20.00",
            "Ca",
        ),
        (
            "HETATM  500  CA  UKN A   9      19.592  -2.876  -3.597  1.00 20.00",
            "C",
        ),
        (
            "ATOM    500 SE   MSE A   9      19.592  -2.876  -3.597  1.00 20.00",
            "Se",
        ),
        (
            "ATOM    500 ZN   ZN  A   9      19.592  -2.876  -3.597  1.00 20.00",
            "Zn",
        ),
        (
            "HETATM  500 FE   HEM A   9      19.592  -2.876  -3.597  1.00 20.00          FE",
            "Fe",
        ),
        (
            "ATOM    500  D1  DOD A   9      19.592  -2.876  -3.597  1.00 20.00           D",
            "H",
        ),
        (
            "ATOM    500  Q   GLY A   9      19.592  -2.876  -3.597  1.00 20.00           X",
            "",
        ),
    ] {
        let particles = read(line, 0);
        assert_eq!(symbols(&particles).concat(), symbol, "{line}");
    }
}

#[test]
fn the_first_of_alternate_locations_is_kept() {
    let atom = |serial: u32, letter: char, residue: u32| {
        format!(
            "ATOM  {serial:5}  CA {letter}GLY A{residue:4}    {serial:8.3}   0.000   0.000  0.50  1.00           C\n"
        )
    };
    let text = [
        atom(1, ' ', 1),
        atom(2, 'A', 1),
        atom(3, 'B', 1),
        atom(4, 'A', 1),
        atom(5, 'B', 2),
        atom(6, 'C', 2),
        atom(7, ' ', 2),
    ];
    let particles = read(&text.concat(), 0);
    assert_eq!(
        particles.column("serial"),
        Some(&[1.0, 2.0, 4.0, 5.0, 7.0][..])
    );
}

#[test]
fn models_are_frames_and_so_is_what_end_ends() {
    let atom = "ATOM      1  N   GLU A   4      69.319  39.142  47.221  1.00 64.20           N\n";
    let model = |number: u32| format!("MODEL     {number:4}\n{atom}TER\nENDMDL\n");
    let nmr = format!("{}{}END\n", model(1), model(2).replace("69.319", "70.000"));
    let vmd = format!(
        "CRYST1\n{atom}END\n{}END\n",
        atom.replace("69.319", "70.000")
    );
    for text in [nmr, vmd] {
        assert_eq!(count_frames(text.as_bytes(), Format::Pdb), Ok(2));
        assert_eq!(read(&text, 0).positions.len(), 1);
        assert_eq!(read(&text, 1).positions[0].x, 70.0);
        let mistake = parse(text.as_bytes(), Format::Pdb, 2).expect_err("two frames");
        assert!(mistake.message.contains("2 frames, and no frame 2"));
    }
}

#[test]
fn what_is_not_there_is_nan() {
    let line = "HETATM100000 O   HOH  ****       1.000   2.000   3.000  ";
    let particles = read(line, 0);
    assert_eq!(particles.column("serial"), Some(&[100_000.0][..]));
    for name in ["residue", "occupancy", "b_factor"] {
        assert!(
            particles.column(name).is_some_and(|c| c[0].is_nan()),
            "{name}"
        );
    }
}

#[test]
fn mistakes_have_their_line() {
    for (text, line, wanted) in [
        (
            TWO.replace("  68.071", "        "),
            3,
            "a coordinate in the columns 31 to 38",
        ),
        (TWO.replace("  38.402", "     nan"), 3, "not finite"),
        (
            TWO.replace("  38.402", "38 . 402"),
            3,
            "`38 . 402` is not a number",
        ),
        (TWO.replace("  38.402", "  1.0e21"), 3, "beyond 1e20"),
        (
            TWO[..TWO.len() - 45].into(),
            3,
            "a coordinate in the columns 39 to 46",
        ),
        ("HEADER\nATO".into(), 2, "wanted a record ATOM or HETATM"),
    ] {
        let mistake = parse(text.as_bytes(), Format::Pdb, 0).expect_err(&text);
        assert!(mistake.to_string().contains(wanted), "{text}\n{mistake}");
        let Place::Line { number, .. } = &mistake.place else {
            panic!("{mistake}");
        };
        assert_eq!(*number, line, "{text}\n{mistake}");
    }
}
