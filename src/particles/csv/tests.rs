//! Tables of spreadsheets and scripts.

use glam::DVec3;

use crate::particles::{Element, Format, Particles, Place, parse};

fn read(text: &str) -> Particles {
    parse(text.as_bytes(), Format::Csv, 0).unwrap_or_else(|m| panic!("{text:?}: {m}"))
}

#[test]
fn names_and_delimiters_are_found() {
    for text in [
        "x,y,z\n1,2,3\n",
        "\u{feff}X;Y;Z\r\n1;2;3\r\n\r\n",
        "# x\ty\tz\n1\t2\t3",
        "#made by a script, on a day\n# of rain\n#x,y,z\n# and more\n1, 2 ,3\n",
        "# a comment; with, all\tof them\nz,y,x\n3,2,1\n",
        "\"x\",\"y\",\"z\"\n\"1\",2,3\n,,\n",
    ] {
        assert_eq!(
            read(text).positions,
            [DVec3::new(1.0, 2.0, 3.0)],
            "{text:?}"
        );
    }
}

#[test]
fn columns_are_numbers_elements_or_left_out() {
    let particles =
        read("name,Element,Radius,x,y,z,Energy,,\na,Si,0.5,1,2,3,,4,\nb,8,1,4,5,6,7,4,\n");
    let names: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["radius", "x", "y", "z", "Energy"]);
    assert!(
        particles
            .column("Energy")
            .is_some_and(|e| e[0].is_nan() && e[1] == 7.0)
    );
    assert_eq!(particles.column("radius"), Some(&[0.5, 1.0][..]));
    let elements = particles.elements.iter().flatten();
    let symbols: Vec<_> = elements.map(|e| e.map(Element::symbol)).collect();
    assert_eq!(symbols, [Some("Si"), Some("O")]);
    assert_eq!(read("x,y,z\n").positions, []);
}

#[test]
fn mistakes_have_their_line() {
    for (text, line, wanted) in [
        ("x,y\n1,2\n", 1, "no column `z`"),
        ("1,2,3\n4,5,6\n", 1, "the first line names the columns"),
        ("x,y,z,X\n1,2,3,4\n", 1, "two columns are named `x`"),
        (
            "x,y,z\n1,2,3\n\n1,2\n",
            4,
            "has 2 values; the first line names 3",
        ),
        ("x,y,z\n1,2,3\n1,2,3,4\n", 3, "has 4 values"),
        ("#a\n# b\nx,y,z\n1,2,NaN\n", 4, "not finite"),
        ("x,y,z\n1,\"2\n\",3\n1,,3\n", 4, "`` is not a number"),
        ("x;y;z\n1,5;2;3\n", 2, "behind a point, not a comma"),
        ("x,y,z,radius\n1,2,3,\n", 2, "the radius `` is not a number"),
        ("x,y,z\n1,2,1e21\n", 2, "beyond 1e20"),
        ("#x\n", 1, "wanted a line with the names"),
        ("\x00\x01\x02", 1, "no column `x`"),
    ] {
        let mistake = parse(text.as_bytes(), Format::Csv, 0).expect_err(text);
        assert!(mistake.to_string().contains(wanted), "{text:?}: {mistake}");
        let Place::Line {
            number,
            text: shown,
        } = &mistake.place
        else {
            panic!("{text:?}: {mistake}");
        };
        assert_eq!(*number, line, "{text:?}: {mistake}");
        let shown_line = text.lines().nth(line as usize - 1).unwrap_or_default();
        let escaped: String = shown_line.escape_debug().filter(|c| *c != '\\').collect();
        let shown: String = shown.chars().filter(|c| *c != '\\').collect();
        assert_eq!(escaped, shown, "{text:?}");
    }
}
