//! Data files of every style.

use glam::DVec3;

use crate::particles::{Format, Particles, Place, parse};

fn read(text: &str) -> Particles {
    parse(text.as_bytes(), Format::LammpsData, 0).unwrap_or_else(|m| panic!("{m}"))
}

/// A file of two atoms with what other sections there may be.
fn data(heading: &str, rows: [&str; 2]) -> String {
    format!(
        "LAMMPS data file via write_data, 3 atoms in the title\n\n2 atoms # all\n1 bonds\n2 atom types\n\n\
         -1.0 1.0 xlo xhi\n0 1 ylo yhi\n0 1 zlo zhi\n0 0 0 xy xz yz\n\nMasses\n\n1 28.0855 # Si\n2 15.9994\n\n\
         Pair Coeffs # lj/cut\n\n1 0.1 0.2\n\nAtoms{heading}\n\n{}\n{}\n\nVelocities\n\n1 0 0 0\n2 0 0 0\n\n\
         Bonds\n\n1 1 1 2\n",
        rows[0], rows[1]
    )
}

#[test]
fn every_style_has_its_columns() {
    for (style, row, names) in [
        ("atomic", "7 2 1 2 3", "id type x y z"),
        ("charge", "7 2 0.5 1 2 3", "id type q x y z"),
        ("bond", "7 9 2 1 2 3", "id mol type x y z"),
        ("angle", "7 9 2 1 2 3", "id mol type x y z"),
        (
            "molecular",
            "7 9 2 1 2 3 0 -1 0",
            "id mol type x y z ix iy iz",
        ),
        ("full", "7 9 2 0.5 1 2 3 # C", "id mol type q x y z"),
        (
            "sphere",
            "7 2 0.5 2.65 1 2 3",
            "id type diameter density x y z radius",
        ),
    ] {
        let particles = read(&data(&format!("  # {style}"), [row, row]));
        assert_eq!(
            particles.positions,
            [DVec3::new(1.0, 2.0, 3.0); 2],
            "{style}"
        );
        let found: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(found.join(" "), names, "{style}");
        assert_eq!(particles.column("type"), Some(&[2.0; 2][..]), "{style}");
        let radius = particles.column("radius");
        assert!(radius.is_none_or(|radius| radius == [0.25; 2]), "{style}");
    }
}

#[test]
fn a_style_is_guessed_where_there_is_one_only() {
    for row in ["1 1 1 2 3", "1 1 1 2 3 0 -1 2"] {
        assert_eq!(
            read(&data("", [row; 2])).positions[0],
            DVec3::new(1.0, 2.0, 3.0)
        );
    }
    for row in [
        "1 1 1 1 2 3",
        "1 1 1 1 1 2 3",
        "1 1 1 2 3 0.5 0 0",
        "1 1 1 2",
    ] {
        let mistake = parse(data("", [row; 2]).as_bytes(), Format::LammpsData, 0).expect_err(row);
        assert!(mistake.to_string().contains("`Atoms # full`"), "{mistake}");
    }
}

#[test]
fn mistakes_have_their_line() {
    let row = "1 1 1 2 3";
    let good = data(" # atomic", [row; 2]);
    for (text, line, wanted) in [
        (
            good.replace("atomic", "ellipsoid"),
            21,
            "`ellipsoid` is not known",
        ),
        (good.replace("2 atoms", "x atoms"), 3, "a whole number"),
        (good.replace("2 atoms", "3 atoms"), 26, "has 1 values"),
        (
            good.replace("2 atoms", "1 atoms"),
            24,
            "more than the 1 atoms",
        ),
        (
            good.replace("2 atoms #", "#"),
            21,
            "wanted the number of atoms",
        ),
        (data(" # atomic", [row, "1 1 1 2"]), 24, "has 4 values"),
        (data(" # atomic", [row, "1 1 1 2 nan"]), 24, "not finite"),
        (
            data(" # sphere", ["1 1 big 1 1 2 3"; 2]),
            23,
            "diameter `big`",
        ),
        (
            good[..good.find("Atoms").unwrap_or(0)].into(),
            20,
            "wanted the section `Atoms`",
        ),
        (
            good.replace("2 atoms", "99999999999999 atoms")
                .replace("Velocities", "1 1 1 2 3"),
            28,
            "values",
        ),
    ] {
        let mistake = parse(text.as_bytes(), Format::LammpsData, 0).expect_err(&text);
        assert!(mistake.to_string().contains(wanted), "{text}\n{mistake}");
        let Place::Line { number, .. } = &mistake.place else {
            panic!("{mistake}");
        };
        assert_eq!(*number, line, "{text}\n{mistake}");
    }
    let mistake = parse(good.as_bytes(), Format::LammpsData, 1).expect_err("one frame");
    assert_eq!(mistake.place, Place::File);
}
