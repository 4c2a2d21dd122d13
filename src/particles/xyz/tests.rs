//! Plain and extended XYZ as programs write it, and as damage leaves it.

use glam::DVec3;

use crate::particles::{Element, Format, Particles, Place, count_frames, parse};

fn read(text: &str, frame: u64) -> Particles {
    parse(text.as_bytes(), Format::Xyz, frame).unwrap_or_else(|mistake| panic!("{mistake}"))
}

fn symbols(particles: &Particles) -> Vec<Option<&'static str>> {
    let elements = particles.elements.iter().flatten();
    elements.map(|e| e.map(Element::symbol)).collect()
}

#[test]
fn plain_files_have_symbols_or_numbers_and_more() {
    let text = "3\r\nwater, ångström\r\n O   0.0 0.0 -1.5e-1 -0.8 a\r\nh\t0 0.757 .587 0.4\r\n1 0 -0.757 0.587 0.4 7\r\n\r\n";
    let particles = read(text, 0);
    assert_eq!(symbols(&particles), [Some("O"), Some("H"), Some("H")]);
    assert_eq!(particles.positions[0], DVec3::new(0.0, 0.0, -0.15));
    let names: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
    // The last number is not there for every particle.
    assert_eq!(names, ["x", "y", "z", "column_5"]);
    assert_eq!(particles.column("column_5"), Some(&[-0.8, 0.4, 0.4][..]));
    assert_eq!(read("1\n\nXx 1 2 3", 0).elements, None);
    assert_eq!(read("0\n\n", 0), read("0\nProperties=pos:R:3\n", 0));
}

#[test]
fn extended_files_name_their_columns() {
    let text = "2\nLattice=\"10 0 0 0 10 0 0 0 10\" name='a Properties=b' \
        Properties=species:S:1:id:I:1:pos:R:3:radius:R:1:vel:R:3:fixed:L:1:q:R:2:tag:S:2 pbc=\"T T F\" done\n\
        Au 7 1 2 3 0.5 4 5 6 T 8 9 a b\nType2 8 4 5 6 0.25 7 8 9 F 1 2 c d\n";
    let particles = read(text, 0);
    assert_eq!(symbols(&particles), [Some("Au"), None]);
    let names: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
    let wanted = [
        "id", "x", "y", "z", "radius", "vel_x", "vel_y", "vel_z", "fixed", "q_1", "q_2",
    ];
    assert_eq!(names, wanted);
    assert_eq!(particles.column("fixed"), Some(&[1.0, 0.0][..]));
    assert_eq!(particles.column("vel_z"), Some(&[6.0, 9.0][..]));
    assert_eq!(particles.positions[1], DVec3::new(4.0, 5.0, 6.0));
    let numbers = read("1\nProperties=\"Z:I:1:pos:R:3\"\n79 0 0 0\n", 0);
    assert_eq!(symbols(&numbers), [Some("Au")]);
}

#[test]
fn frames_follow_each_other() {
    let text = "1\na\nC 1 0 0\n2\nb\nC 2 0 0\nC 3 0 0\n\n1\nc\nC not read 0\n";
    assert_eq!(read(text, 1).positions.len(), 2);
    assert_eq!(read(text, 1).positions[1].x, 3.0);
    assert_eq!(count_frames(text.as_bytes(), Format::Xyz), Ok(3));
    // What lies within the frames before is not looked at.
    assert_eq!(read("1\n\n?\n1\n\nC 4 0 0", 1).positions[0].x, 4.0);
    let mistake = parse(text.as_bytes(), Format::Xyz, 3).expect_err("three frames");
    assert_eq!(mistake.place, Place::File);
    assert!(mistake.message.contains("3 frames, and no frame 3"));
}

#[test]
fn mistakes_have_their_line() {
    for (text, line, wanted) in [
        ("three\n", 1, "wanted the number of particles"),
        ("-1\n", 1, "wanted the number of particles"),
        ("1 2\n", 1, "wanted the number of particles"),
        ("1", 1, "wanted a comment"),
        ("3\n\nC 0 0 0\n", 3, "wanted particle 2 of 3"),
        ("99999999999999999\n\nC 0 0 0\n", 3, "ends here"),
        ("1\n\nC 0 0 0\nC 0 0 0\n", 4, "more than the 1 particles"),
        ("2\n\nC 0 0 0\n\n", 4, "a symbol and three"),
        ("1\n\nC 0 0\n", 3, "a symbol and three"),
        (
            "1\n\nC 1.0 nan 2\n",
            3,
            "the coordinate `NaN` is not finite",
        ),
        ("1\n\nC 1.0 x 2\n", 3, "the coordinate `x` is not a number"),
        ("1\n\nC 1.0 -1e21 2\n", 3, "beyond 1e20"),
        ("\x07\x00\x1b[2J\n", 1, "wanted the number"),
        ("1\nProperties=species:S:1\nC\n", 2, "must have `pos:R:3`"),
        ("1\nProperties=pos:R:2\n0 0\n", 2, "must have `pos:R:3`"),
        ("1\nProperties=pos:R\n0 0\n", 2, "wanted groups"),
        ("1\nProperties=\n0 0\n", 2, "wanted groups"),
        ("1\nProperties=pos:R:3:a:X:1\n0 0\n", 2, "wanted groups"),
        (
            "1\nProperties=pos:R:3:a:R:18446744073709551615\n",
            2,
            "10000 columns",
        ),
        ("1\nProperties=pos:R:3:a:R:0\n0 0\n", 2, "wanted 1 or more"),
        (
            "1\nProperties=pos:R:3:x:R:1\n0 0 0 0\n",
            2,
            "two columns are named `x`",
        ),
        (
            "1\nProperties=pos:R:3:a:R:1\n0 0 0\n",
            3,
            "has 3 values; `Properties` names 4",
        ),
        ("1\nProperties=pos:R:3\n0 0 0 0\n", 3, "has 4 values"),
        (
            "1\nProperties=pos:R:3:a:R:1\n0 0 0 b\n",
            3,
            "the a `b` is not a number",
        ),
        (
            "1\nProperties=pos:R:3:a:L:1\n0 0 0 2\n",
            3,
            "neither `T` nor `F`",
        ),
    ] {
        let mistake = parse(text.as_bytes(), Format::Xyz, 0).expect_err(text);
        assert!(mistake.to_string().contains(wanted), "{text:?}: {mistake}");
        let Place::Line {
            number,
            text: shown,
        } = &mistake.place
        else {
            panic!("{text:?}: {mistake}");
        };
        assert_eq!(*number, line, "{text:?}: {mistake}");
        assert!(!shown.contains(char::is_control), "{shown:?}");
    }
    let second = parse(b"1\n\nC 0 0 0\nC 0 0 0\n", Format::Xyz, 1).expect_err("no count");
    assert!(second.to_string().contains("too small?"), "{second}");
    assert!(parse(b"", Format::Xyz, 0).is_err());
    assert!(parse(b"\n\n", Format::Xyz, 0).is_err());
}
