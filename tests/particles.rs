//! Particle files on the command line and in scene files, through the program.

use crate::cli_support::{Folder, GOOD, holds, mean};

/// Three atoms of water in a row with a fourth that is no element.
const WATER: &str = "4\nProperties=species:S:1:pos:R:3:q:R:1\nO 0 0 0 -0.8\nH 1 0 0 0.4\nH -1 0 0 0.4\nXx 0 5 0 0\n";

/// Little-endian f64 of shape (n, 4), as numpy writes it.
fn npy(rows: &[[f64; 4]]) -> Vec<u8> {
    let header = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 4), }}",
        rows.len()
    );
    let padded = format!("{header:<117}\n");
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(padded.as_bytes());
    bytes.extend(rows.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("water.xyz", WATER);
    folder.write(
        "grains.npy",
        npy(&[[0.0, 0.0, 0.0, 1.0], [3.0, 0.0, 0.0, 0.5]]),
    );
    folder.write("bad.xyz", "2\n\nC 0 0 0\nC 1 nan 0\n");
    folder.write("short.xyz", "2\n\nC 0 0 0\n");
    folder.write("plain.csv", "x,y,z,t\n0,0,0,1\n2,0,0,2\n");
    folder.write("old.npy", "kept");
    folder
}

#[test]
fn a_particle_file_is_a_picture() {
    let folder = folder();
    let (image, stats) = folder.render("grains.npy --size 40x30 --spp 16 -o a.npy");
    // Gray balls before white.
    let corner = image.pixels[0];
    assert_eq!(corner, [1.0; 3]);
    let whole = mean(&image);
    assert!((0.3..0.99).contains(&whole), "{whole}");
    assert_eq!(stats["scene"], "grains");
    // Nothing is lit by a black background but by the lamp.
    let (dark, _) = folder.render("grains.npy --size 40x30 --spp 16 --background black -o b.npy");
    assert_eq!(dark.pixels[0], [0.0; 3]);
    assert!(mean(&dark) > 0.001 && mean(&dark) < mean(&image));
}

#[test]
fn colours_and_radii_are_chosen() {
    let folder = folder();
    let hash = |arguments: &str| {
        let (_, stats) = folder.render(&format!("{arguments} --size 8x6 --spp 1 -o c.npy"));
        stats["scene_hash"].as_str().expect("a hash").to_owned()
    };
    // What has no element has no van der Waals radius.
    holds(
        &folder.refused(&["water.xyz"]),
        &["particle 4", "number or a column"],
    );
    let mut hashes = vec![
        hash("water.xyz --radius-by 1"),
        hash("water.xyz --radius-by 0.5"),
        hash("water.xyz --radius-by 1 --color-by q"),
        hash("water.xyz --radius-by 1 --color-by q --map turbo"),
        hash("plain.csv --radius-by t"),
        hash("plain.csv --radius-by t --color-by t"),
        hash("plain.csv --radius-by t --background 0.5,0.5,1"),
    ];
    // By element is what it is without a word.
    assert_eq!(
        hash("water.xyz --radius-by 1 --color-by element"),
        hashes[0]
    );
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), 7);
}

#[test]
fn a_scene_file_takes_particles_from_beside_it() {
    let folder = folder();
    std::fs::create_dir(folder.path("sub")).expect("a folder");
    let table = "\n[[particles]]\nfile = \"../water.xyz\"\nradius = 0.3\ncolor_by = \"element\"\n\
                 select = \"element == O or element == H\"\n";
    folder.write("sub/scene.toml", format!("{GOOD}{table}"));
    folder.write("alone.toml", GOOD);
    for (name, spheres) in [("alone.toml", 3), ("sub/scene.toml", 6)] {
        let said = folder.ok(&format!("scene check {name}"));
        holds(&said, &[&format!("spheres      {spheres}\n")]);
    }
    // The file may not be replaced.
    folder.write(
        "sub/scene.toml",
        format!(
            "{GOOD}{}",
            table.replace("../water.xyz", "../grains.npy").replace(
                "color_by = \"element\"\nselect = \"element == O or element == H\"",
                "color_by = \"radius\""
            )
        ),
    );
    let before = folder.read("grains.npy");
    holds(
        &folder.refused(&["sub/scene.toml", "-o", "grains.npy"]),
        &["would replace the input"],
    );
    assert_eq!(folder.read("grains.npy"), before);
}

#[test]
fn bad_files_and_options_are_refused() {
    let folder = folder();
    for (arguments, says) in [
        (&["bad.xyz"][..], &["bad.xyz", "line 4", "nan"][..]),
        (&["short.xyz"], &["short.xyz", "line"]),
        (&["missing.pdb"], &["missing.pdb", "No such file"]),
        (
            &["plain.csv"],
            &["neither radii nor elements", "--radius-by"],
        ),
        (
            &["plain.csv", "--radius-by", "r"],
            &["--radius-by", "no column `r`", "x, y, z, t"],
        ),
        (
            &["plain.csv", "--radius-by", "0"],
            &["--radius-by", "must be positive"],
        ),
        (
            &["plain.csv", "--radius-by", "1", "--color-by", "element"],
            &["--color-by", "no elements"],
        ),
        (
            &["plain.csv", "--radius-by", "1", "--map", "turbo"],
            &["--map", "--color-by"],
        ),
        (&["plain.csv", "--map", "jet"], &["--map", "viridis"]),
        (
            &["plain.csv", "--background", "1,2"],
            &["--background", "three numbers"],
        ),
        (
            &["plain.csv", "--background", "-1,0,0"],
            &["--background", "three numbers"],
        ),
        (
            &["lecture", "--color-by", "element"],
            &["--color-by", "particle files"],
        ),
        (
            &["grains.npy", "-o", "grains.npy"],
            &["would replace the input"],
        ),
    ] {
        holds(&folder.refused(arguments), says);
    }
    assert_eq!(folder.read("old.npy"), b"kept");
}
