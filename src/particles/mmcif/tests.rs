//! Loops of `_atom_site` as the wwPDB writes them, and other forms of the same.

use glam::DVec3;

use crate::particles::{Element, Format, Particles, Place, count_frames, parse};

fn read(text: &str, frame: u64) -> Particles {
    parse(text.as_bytes(), Format::Mmcif, frame).unwrap_or_else(|m| panic!("{m}"))
}

const LOOP: &str = "\
data_1TII
_entry.id 1TII
_struct.title
;A title; with 'quotes' and
loop_
;
# the atoms
loop_
_atom_site.group_PDB
_atom_site.id
_atom_site.type_symbol
_atom_site.label_atom_id
_atom_site.label_alt_id
_atom_site.auth_asym_id
_atom_site.auth_seq_id
_atom_site.pdbx_PDB_ins_code
_atom_site.Cartn_x
_atom_site.Cartn_y
_atom_site.Cartn_z
_atom_site.occupancy
_atom_site.B_iso_or_equiv
_atom_site.pdbx_PDB_model_num
ATOM 1 N N . AA 4 ? 69.319 39.142 47.221 1.00 64.20 1
ATOM 2 C CA A AA 4 ? 68.071 38.402
 47.431 0.50 ? 1
ATOM 3 C CA B AA 4 ? 68.171 38.502 47.531 0.50 1.0 1
HETATM 4 ZN ZN . B . ? 1(2) -2.5 3 . 2.0 1
HETATM 5 O \"O5'\" . B . ? 9 9 9 1 2.0 2 # the second model
#
loop_
_other.id 1 2 3
";

#[test]
fn loops_have_the_columns_of_pdb_files() {
    let particles = read(LOOP, 0);
    let wanted = [
        DVec3::new(69.319, 39.142, 47.221),
        DVec3::new(68.071, 38.402, 47.431),
        DVec3::new(1.0, -2.5, 3.0),
    ];
    assert_eq!(particles.positions, wanted);
    let elements = particles.elements.iter().flatten();
    let symbols: Vec<_> = elements.map(|e| e.map(Element::symbol)).collect();
    assert_eq!(symbols, [Some("N"), Some("C"), Some("Zn")]);
    let names: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
    let columns = [
        "serial",
        "chain",
        "residue",
        "x",
        "y",
        "z",
        "occupancy",
        "b_factor",
    ];
    assert_eq!(names, columns);
    assert_eq!(particles.column("serial"), Some(&[1.0, 2.0, 4.0][..]));
    assert_eq!(particles.column("chain"), Some(&[0.0, 0.0, 1.0][..]));
    assert!(
        particles
            .column("b_factor")
            .is_some_and(|c| c[1].is_nan() && c[2] == 2.0)
    );
    assert!(
        particles
            .column("residue")
            .is_some_and(|c| c[1] == 4.0 && c[2].is_nan())
    );
    assert_eq!(read(LOOP, 1).positions, [DVec3::splat(9.0)]);
    assert_eq!(count_frames(LOOP.as_bytes(), Format::Mmcif), Ok(2));
    assert!(parse(LOOP.as_bytes(), Format::Mmcif, 2).is_err());
}

#[test]
fn one_atom_needs_no_loop() {
    let text = "data_a\n_ATOM_SITE.cartn_X 1\n_atom_site.Cartn_y '2'\n_atom_site.Cartn_z\n;3\n;\n_cell.a 1\n";
    let particles = read(text, 0);
    assert_eq!(particles.positions, [DVec3::new(1.0, 2.0, 3.0)]);
    assert_eq!(particles.columns.len(), 3);
    let small = "loop_ _atom_site.Cartn_x _atom_site.Cartn_y _atom_site.Cartn_z 1 2 3 4 5 6";
    assert_eq!(read(small, 0).positions.len(), 2);
}

#[test]
fn mistakes_have_their_line() {
    for (text, line, wanted) in [
        (LOOP.replace("39.142", "nan"), 23, "not finite"),
        (
            LOOP.replace("39.142", "?"),
            23,
            "the coordinate y is missing",
        ),
        (LOOP.replace("39.142", "a"), 23, "`a` is not a number"),
        (LOOP.replace(" 47.431", "1e21"), 25, "beyond 1e20"),
        (
            LOOP.replace(" 2 # the", " # the"),
            30,
            "14 values of an atom",
        ),
        (LOOP.replace("Cartn_y", "Cartn_q"), 9, "no column `y`"),
        (LOOP[..LOOP.len() - 80].into(), 28, "14 values of an atom"),
        (LOOP.replace("O5'\"", "O5'"), 28, "the quote does not end"),
        (
            LOOP.replace(";\n#", "\n#"),
            4,
            "the text field does not end",
        ),
        (
            LOOP.replace("_atom_site.", "_atom_sight."),
            31,
            "wanted the category",
        ),
        (
            "loop_\n_atom_site_label\n_atom_site_fract_x\nC 0.5\n".into(),
            3,
            "crystal",
        ),
        (
            "loop_\n_atom_site.Cartn_x _atom_site.Cartn_y _atom_site.Cartn_z\n".into(),
            2,
            "no atom",
        ),
        (
            "_atom_site.Cartn_x _atom_site.Cartn_y 2\n".into(),
            1,
            "a value behind a tag",
        ),
        ("MODEL 1".into(), 1, "wanted the category"),
    ] {
        let mistake = parse(text.as_bytes(), Format::Mmcif, 0).expect_err(&text);
        assert!(mistake.to_string().contains(wanted), "{text}\n{mistake}");
        let Place::Line { number, .. } = &mistake.place else {
            panic!("{mistake}");
        };
        assert_eq!(*number, line, "{text}\n{mistake}");
    }
}
