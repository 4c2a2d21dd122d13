//! What the program says to bad input, and that it does nothing else: exit code 2, a message that
//! names the place and the way out, and no file made or changed.

use crate::cli_support::{Folder, GOOD, holds};

/// Splits a table whose columns are separated by bars.
fn rows<const N: usize>(table: &str) -> impl Iterator<Item = [&str; N]> {
    table.trim().lines().map(|row| {
        let cells: Vec<_> = row.split(" | ").map(str::trim).collect();
        cells
            .try_into()
            .unwrap_or_else(|_| panic!("not {N} cells: {row}"))
    })
}

/// A folder with good and bad files; `old.npy` is the output of most runs.
fn folder() -> Folder {
    let folder = Folder::with_scene();
    folder.write("old.npy", "kept");
    folder.write("text.txt", "kept");
    folder.write("empty.toml", "");
    folder.write("binary.toml", [0x89, b'P', b'N', b'G', 0, 1, 2, 0xff]);
    folder.write("latin.toml", b"# Stra\xdfe\n[camera]\n");
    std::fs::create_dir(folder.path("folder.png")).expect("a folder");
    folder
}

#[test]
fn options_are_refused_with_their_name_and_the_way_out() {
    let folder = folder();
    let table = "
        --sped 4 | --sped | --help
        --spp | --spp | --help
        --spp 0 | --spp | from 1 to 2^48
        --spp -1 | --spp | from 1 to 2^48
        --spp 1.5 | --spp | from 1 to 2^48
        --spp 99999999999999999999 | --spp | from 1 to 2^48
        --spp 281474976710657 | --spp | from 1 to 2^48
        --size 0x5 | --size | as in 640x480
        --size 5x0 | --size | as in 640x480
        --size 640 | --size | as in 640x480
        --size=-1x5 | --size | as in 640x480
        --size 65537x1 | --size | at most 65536
        --size 99999999999x1 | --size | as in 640x480
        --crop 1,2,3 | --crop | as in 100,50,64x64
        --crop 1,2,0x4 | --crop | as in 100,50,64x64
        --crop 630,0,64x64 | --crop 630,0,64x64 | 640x640
        --size 8x8 --crop 0,5,8x4 | --crop 0,5,8x4 | 8x8
        --crop 4294967295,0,65536x1 | --crop | 640x640
        --error 0 | --error | try 1% or 0.01
        --error -1% | --error | try 1% or 0.01
        --error nan | --error | try 1% or 0.01
        --error much | --error | try 1% or 0.01
        --error 200% | --error | less than 100%
        --error 2 | --error | write 2%
        --time 0 | --time | try 30s
        --time -5 | --time | try 30s
        --time 1e400 | --time | try 30s
        --time soon | --time | try 30s
        --seed -1 | --seed | 2^64 - 1
        --seed 18446744073709551616 | --seed | 2^64 - 1
        --max-bounces -1 | --max-bounces | 0..=65535
        --max-bounces 65536 | --max-bounces | 0..=65535
        --sample-range 5..5 | --sample-range | as in 0..256
        --sample-range 6..5 | --sample-range | as in 0..256
        --sample-range 7 | --sample-range | as in 0..256
        --sample-range 0..281474976710657 | --sample-range | 2^48
        --threads 0 | --threads | 1..=1024
        --threads 1025 | --threads | 1..=1024
        --exposure bright | --exposure | from -100 to 100
        --exposure 101 | --exposure | from -100 to 100
        --integrator lecture --termination 1 | --termination | as in 0.2
        --integrator lecture --termination -0.1 | --termination | as in 0.2
        --integrator whitted | --integrator | path, bsdf, nee, lecture
        --light-sampling disc | --light-sampling | projected, cone
        --integrator bsdf --light-sampling cone | --light-sampling | --integrator bsdf does not
        --sampler random | --sampler | sobol, independent
        --roulette maybe | --roulette | on, off
        --lamp-images maybe | --lamp-images | on, off
        --radiance-cache maybe | --radiance-cache | auto, on, off
        --backend tpu | --backend | auto, gpu, cpu
        --geometry grid | --geometry | auto, baked, list, bvh
        --progress loud | --progress | auto, plain, json, none
        --spp 4 --sample-range 0..4 | --spp | --sample-range
        -q -v | --quiet | --verbose
        --spp 4 --spp 5 | --spp | --help
        --termination 0.3 | --termination | add --integrator lecture
        --integrator lecture --roulette on | roulette | --termination 0
        --device 0 --backend cpu | --device | --backend cpu
        --device 99 | --device | devices are
        --device 99 --dump-wgsl k.wgsl | --device | devices are
        --device Voodoo2 | --device | 'Voodoo2'
    ";
    for [arguments, name, way_out] in rows(table) {
        let mut arguments: Vec<_> = arguments.split_whitespace().collect();
        arguments.extend(["-o", "old.npy"]);
        if arguments[0] == "--spp" && arguments[1] == "-o" {
            // An option without its value comes last.
            arguments = vec!["-o", "old.npy", "--spp"];
        }
        holds(&folder.refused(&arguments), &[name, way_out]);
    }
}

#[test]
fn outputs_are_refused_before_any_work() {
    let folder = folder();
    let table = "
        -o image.jpg | 'image.jpg' | .png, .exr or .npy
        -o image | 'image' | .png, .exr or .npy
        -o .png | '.png' | .png, .exr or .npy
        -o old.npy -o image.tiff | 'image.tiff' | .png, .exr or .npy
        -o missing/image.png | 'missing/image.png' | directory 'missing' does not exist
        -o text.txt/image.png | 'text.txt/image.png' | irectory
        -o folder.png | 'folder.png' | is a directory
        -o new.png/ | 'new.png/' | directory
        -o old.npy -o ./old.npy | 'old.npy' and './old.npy' | same file
        -o new.npy -o folder.png/../new.npy | 'new.npy' and 'folder.png/../new.npy' | same file
        -o old.npy --stats old.npy | 'old.npy' | same file
        -o old.npy --stats missing/s.json | 'missing/s.json' | directory 'missing' does not exist
        -o old.npy --stats folder.png | 'folder.png' | is a directory
        -o old.npy --dump-wgsl missing/k.wgsl | 'missing/k.wgsl' | directory 'missing' does not exist
        -o old.npy --stats good.toml | 'good.toml' | would replace the input
        -o old.npy --dump-wgsl ./good.toml | './good.toml' | would replace the input
    ";
    for [arguments, name, reason] in rows(table) {
        let words: Vec<_> = ["good.toml"]
            .into_iter()
            .chain(arguments.split_whitespace())
            .collect();
        holds(&folder.refused(&words), &[name, reason]);
    }
    holds(&folder.refused(&["good.toml", "-o", ""]), &["--output"]);
    // A scene need not be called .toml; the output may well be.
    folder.write("scene.exr", GOOD);
    holds(
        &folder.refused(&["scene.exr", "-o", "scene.exr"]),
        &["'scene.exr'", "would replace the input"],
    );
}

#[test]
fn words_that_are_no_scene_are_refused() {
    let folder = folder();
    let table = "
        lectrue | `lectrue` | did you mean `lecture`
        galss | `galss` | did you mean `glass`
        something | `something` | lecture, lecture-reflective, glass, field, ashikhmin, disney, sheen, nylon
        missing.toml | missing.toml | No such file
        ./missing/lecture | ./missing/lecture | No such file
        folder.png | folder.png | directory
        binary.toml | binary.toml | binary data
        latin.toml | latin.toml:1:7 | UTF-8
        text.txt | text.txt:1 | error
        empty.toml | empty.toml | scene list
    ";
    for [word, name, reason] in rows(table) {
        let said = folder.refused(&[word, "-o", "old.npy"]);
        holds(&said, &[name, reason]);
        assert_eq!(said, folder.refused(&["render", word, "-o", "old.npy"]));
        assert_eq!(said, folder.refused(&["effects", word]));
        assert_eq!(said, folder.refused(&["scene", "check", word]));
    }
    holds(
        &folder.refused(&["", "-o", "old.npy"]),
        &["no scene", "built-in"],
    );
}

#[test]
fn words_in_the_wrong_place_are_refused() {
    let folder = folder();
    let table = "
        good.toml empty.toml | 'empty.toml' | one scene
        good.toml effects | `effects` | comes first
        --spp 4 effects | `effects` | comes first
        --spp 4 devices --json | --json | --help
        scene chekc good.toml | 'chekc' | check
        scene list lectrue | 'lectrue' | lecture, lecture-reflective, glass, field
        completions tcsh | 'tcsh' | bash, elvish, fish, powershell, zsh
        completions | <SHELL> | --help
        devices 0 | '0' | --help
        effects --nonsense | '--nonsense' | --help
    ";
    for [arguments, name, way_out] in rows(table) {
        let words: Vec<_> = arguments.split_whitespace().collect();
        holds(&folder.refused(&words), &[name, way_out]);
    }
}

#[test]
fn mistakes_of_a_scene_are_shown_with_their_line() {
    let folder = folder();
    let table = r#"
        look_at = | lok_at = | 3 | did you mean `look_at`
        [camera] | [camrea] | 1 | camera
        fov = 36.0 | fov = "wide" | 4 | number
        fov = 36.0 | fov = 180.0 | 4 | 180
        fov = 36.0 | fov = 36,0 | 4 | decimal point
        fov = 36.0 | fov = .5 | 4 | 0.5
        fov = 36.0 | fov = | 4 | error
        fov = 36.0 | fov = 36.0\nfov = 37.0 | 5 | duplicate
        position = [0.0, 0.0, -4.0] | position = [0.0, 0.0] | 2 | 3
        position = [0.0, 0.0, -4.0] | position = [nan, 0.0, 0.0] | 2 | nan
        position = [0.0, 0.0, -4.0] | position = [inf, 0.0, 0.0] | 2 | inf
        position = [0.0, 0.0, -4.0] | position = [1e21, 0.0, 0.0] | 2 | 1e20
        look_at = [0.0, 0.0, 6.0] | look_at = [0.0, 0.0, -4.0] | 3 | position
        look_at = [0.0, 0.0, 6.0] | look_at = [0.0, 9.0, -4.0] | 3 | `up`
        focus_distance = 4.0 | (nothing) | 5 | `focus_distance` is missing
        focus_distance = 4.0 | focus_distance = 0.0 | 6 | focus_distance
        aperture_radius = 0.1 | aperture_radius = -0.1 | 5 | aperture_radius
        width = 8 | width = 0 | 8 | width
        height = 6 | height = -6 | 9 | height
        height = 6 | height = 6.5 | 9 | height
        height = 6 | (nothing) | 7 | height
        [0.7, 0.8, 1.0] | [0.7, -0.8, 1.0] | 11 | radiance
        "diffuse" | "difuse" | 13 | did you mean "diffuse"
        albedo = [0.9, 0.8, 0.7] | albedo = [0.9, 1.1, 0.7] | 14 | albedo
        albedo = [0.9, 0.8, 0.7] | reflectance = [1, 1, 1] | 14 | mirror
        reflectance = [0.9, 0.9, 0.9] | (nothing) | 15 | `reflectance`
        ior = 1.5 | ior = 0.0 | 20 | ior
        radius = 1.0 | radius = -1.0 | 23 | radius
        radius = 1.0 | radius = 0.0 | 23 | radius
        radius = 1.0 | radius = nan | 23 | nan
        "white"\n[[ | "whit"\n[[ | 24 | did you mean "white"
        "glass"\n[[ | "gold"\n[[ | 28 | chrome
        [[sphere]] | [sphere] | 25 | [[sphere]]
    "#;
    for [from, to, line, says] in rows(table) {
        let (from, to) = (
            from.replace("\\n", "\n"),
            to.replace("\\n", "\n").replace("(nothing)", ""),
        );
        assert!(GOOD.contains(&from), "{from:?} is not in the good scene");
        folder.write("bad.toml", GOOD.replacen(&from, &to, 1));
        let said = folder.refused(&["bad.toml", "-o", "old.npy", "--stats", "new.json"]);
        holds(&said, &[&format!("bad.toml:{line}:"), says]);
        assert_eq!(
            said,
            folder.refused(&["scene", "check", "bad.toml"]),
            "{to}"
        );
    }
}

#[test]
fn all_mistakes_of_a_scene_are_shown_at_once() {
    let folder = folder();
    let bad = GOOD
        .replace("radius = 0.5", "radius = -0.5")
        .replace("fov = 36.0", "fov = 0.0");
    folder.write("bad.toml", bad);
    let said = folder.refused(&["bad.toml"]);
    assert_eq!(said.matches("error: ").count(), 3, "{said}");
    holds(&said, &["bad.toml:4:", "bad.toml:27:", "bad.toml:31:"]);
}
