//! The kernel holds the effects in use, and no trace of the others: every set links, is valid, and
//! names exactly its effects.

mod common;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use common::{scene, scene_file, scene_files};
use gpu_trace::effects::Effects;
use gpu_trace::placement::Placement;
use gpu_trace::placement::lights::MOST_WEIGHED;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Offset, Settings};
use gpu_trace::shader::{Stage, link};
use rayon::prelude::*;

type Set = BTreeSet<&'static str>;

/// All effects, in the table's order.
const ALL: [&str; 27] = [
    "baked",
    "list",
    "pole",
    "interior",
    "straddle",
    "nested",
    "nudge",
    "ulp",
    "lens",
    "sobol",
    "classes",
    "features",
    "adaptive",
    "diffuse",
    "mirror",
    "dielectric",
    "priority",
    "reflective",
    "emission",
    "environment",
    "lecture",
    "bsdf",
    "lights",
    "projected",
    "table",
    "mis",
    "roulette",
];

/// Of these, only one can be in use.
const EXCLUSIVE: [[&str; 2]; 10] = [
    ["baked", "list"],
    ["lecture", "bsdf"],
    ["lecture", "roulette"],
    ["lecture", "lights"],
    ["lecture", "projected"],
    ["lecture", "table"],
    ["lecture", "mis"],
    ["nudge", "ulp"],
    ["nested", "nudge"],
    ["nested", "ulp"],
];

const MATERIALS: [&str; 4] = ["diffuse", "mirror", "dielectric", "reflective"];

/// Effects that must leave no trace in the WGSL where they are not in use, in any case, not even as
/// a part of a name.
const WORDS: [&str; 22] = [
    "diffuse",
    "mirror",
    "dielectric",
    "priority",
    "reflective",
    "lens",
    "sobol",
    "classes",
    "features",
    "adaptive",
    "environment",
    "emission",
    "roulette",
    "pole",
    "interior",
    "lecture",
    "lights",
    "projected",
    "table",
    "nested",
    "nudge",
    "ulp",
];

fn possible(set: &Set) -> bool {
    let nudged = set.contains("nudge") || set.contains("ulp");
    // A lamp that the lens straddles is not sampled, and here all lamps are of one material.
    if set.contains("lights") && set.contains("straddle") && !nudged {
        return false;
    }
    // What is inside without glass, lens or nudge is a room around the camera, which has no sky.
    let room = set.contains("interior") && !set.contains("dielectric") && !set.contains("straddle");
    if room && set.contains("environment") {
        return false;
    }
    EXCLUSIVE
        .iter()
        .all(|pair| !pair.iter().all(|name| set.contains(name)))
}

/// `names` and the least that they need to be a kernel.
fn completed(names: impl IntoIterator<Item = &'static str>) -> Set {
    let mut set: Set = names.into_iter().collect();
    if !set.contains("list") {
        set.insert("baked");
    }
    if !set.contains("lecture") {
        set.insert("bsdf");
    }
    if ["mis", "projected", "table"]
        .iter()
        .any(|n| set.contains(n))
    {
        set.insert("lights");
    }
    if set.contains("lights") {
        set.insert("emission");
        if !set.contains("projected") {
            set.insert("table");
        }
    }
    let nudged = set.contains("nudge") || set.contains("ulp");
    if nudged {
        set.insert("straddle");
    } else if set.contains("straddle") {
        set.extend(["lens", "diffuse"]);
    }
    if set.contains("straddle") {
        set.insert("interior");
    }
    if set.contains("nested") {
        // A ball of another material in glass.
        set.extend(["dielectric", "diffuse"]);
    }
    if set.contains("priority") {
        set.insert("dielectric");
    }
    if set.contains("dielectric") {
        set.insert("interior");
    }
    let surface = ["pole", "interior", "emission"]
        .iter()
        .any(|name| set.contains(name));
    if surface && !MATERIALS.iter().any(|m| set.contains(m)) {
        set.insert("diffuse");
    }
    set
}

/// A scene and settings that ask for exactly the effects of `set`.
fn asking_for(set: &Set) -> (Scene, Settings) {
    let has = |name: &str| set.contains(name);
    let mut text =
        String::from("[camera]\nposition = [0, 0, 6]\nlook_at = [0, 0, 0]\nfov = 40.0\n");
    if has("lens") {
        text += "aperture_radius = 0.1\nfocus_distance = 6.0\n";
    }
    text += "[image]\nwidth = 16\nheight = 16\n";
    if has("environment") {
        text += "[environment]\nradiance = [0.5, 0.6, 0.7]\n";
    }
    let materials: Vec<&str> = MATERIALS.into_iter().filter(|m| has(m)).collect();
    for (i, material) in materials.iter().enumerate() {
        let members = match *material {
            "diffuse" => "albedo = [0.5, 0.6, 0.7]",
            "mirror" => "reflectance = [0.9, 0.8, 0.7]",
            "dielectric" => "ior = 1.5",
            _ => "albedo = [0.1, 0.2, 0.3]\nspecular = [0.5, 0.5, 0.5]\nepsilon = 0.01\nmu = 10.0",
        };
        let _ = writeln!(text, "[material.m{i}]\ntype = \"{material}\"\n{members}");
        if has("emission") && i == 0 {
            text += "emission = [1.0, 2.0, 3.0]\n";
        }
    }
    let mut sphere = |material: usize, x: f64, y: f64, radius: f64| {
        let _ = writeln!(
            text,
            "[[sphere]]\ncenter = [{x:?}, {y:?}, 0.0]\nradius = {radius:?}\nmaterial = \"m{material}\""
        );
    };
    for i in 0..materials.len() {
        // Off the view axis: what the view starts at has a pole frame.
        sphere(i, 2.0 * i as f64, 1.5, 0.5);
    }
    if has("priority")
        && let Some(i) = materials.iter().position(|m| *m == "dielectric")
    {
        sphere(i, 2.0 * i as f64, 1.75, 0.5);
    }
    if has("nested")
        && let Some(i) = materials.iter().position(|m| *m == "dielectric")
    {
        sphere(0, 2.0 * i as f64, 1.5, 0.49999);
    }
    if has("projected") && has("table") {
        for i in 0..=MOST_WEIGHED {
            sphere(0, 0.4 * i as f64 - 1.6, 4.0, 0.1);
        }
    }
    let nudged = has("nudge") || has("ulp");
    if has("straddle") && !nudged {
        // Through the lens, with something so small and far that this one gets no pole frame.
        sphere(0, 0.0, 0.0, 6.0);
        sphere(0, 900.0, 900.0, 0.01);
    }
    if has("pole") {
        sphere(0, 0.0, -10001.0, 10000.0);
    }
    if has("interior") && !has("dielectric") && !has("straddle") {
        // Around the camera, and too far away for a pole frame.
        sphere(0, 0.0, 0.0, 100.0);
    }
    let scene = scene(&text);
    let settings = Settings {
        geometry: if has("list") {
            GeometryChoice::List
        } else {
            GeometryChoice::Baked
        },
        integrator: if has("lecture") {
            Integrator::Lecture { termination: 0.2 }
        } else if has("mis") {
            Integrator::Path
        } else if has("lights") {
            Integrator::Nee
        } else {
            Integrator::Bsdf
        },
        light_sampling: if has("lights") && !has("projected") {
            LightSampling::Cone
        } else {
            LightSampling::Projected
        },
        roulette: has("roulette"),
        adaptive: has("adaptive"),
        classes: has("classes"),
        features: has("features"),
        sampler: if has("sobol") {
            Sampler::Sobol
        } else {
            Sampler::Independent
        },
        offset: match (has("nudge"), has("ulp")) {
            (true, _) => Offset::Out(1.0e-4),
            (_, true) => Offset::Ulp,
            _ => Offset::Exact,
        },
        ..Settings::for_scene(&scene)
    };
    (scene, settings)
}

fn placed(scene: &Scene, settings: &Settings) -> Placement {
    Placement::with_offset(scene, settings.width, settings.height, settings.offset)
}

/// Links both stages for a set; what is wrong, if anything is.
fn fault(set: &Set) -> Option<String> {
    let (scene, settings) = asking_for(set);
    let placement = placed(&scene, &settings);
    let effects = Effects::derive(&scene, &placement, &settings);
    let derived: Set = effects.names().collect();
    if derived != *set {
        return Some(format!("{set:?}: the scene asks for {derived:?}"));
    }
    // The probe has neither geometry nor loop: once for each set of the rest.
    let probe = !["list", "roulette"].iter().any(|name| set.contains(name));
    fault_of(&scene, &placement, &effects, probe)
}

fn fault_of(
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
    probe: bool,
) -> Option<String> {
    let names: Vec<&str> = effects.names().collect();
    if probe && let Err(e) = link(Stage::Probe, scene, placement, effects) {
        return Some(format!("{names:?}: the probe: {e}"));
    }
    match link(Stage::Path, scene, placement, effects) {
        Err(e) => Some(format!("{names:?}: {e}")),
        Ok(kernel) => wrong_words(&kernel.wgsl, effects).map(|w| format!("{names:?}: {w}")),
    }
}

/// A word that is there and should not be, or the other way round.
fn wrong_words(wgsl: &str, effects: &Effects) -> Option<String> {
    let wgsl = wgsl.to_lowercase();
    for word in WORDS {
        let lines: Vec<&str> = wgsl.lines().filter(|line| line.contains(word)).collect();
        match (effects.has(word), lines.first()) {
            (false, Some(line)) => return Some(format!("{word} occurs: {line}")),
            (true, None) => return Some(format!("{word} does not occur")),
            _ => {}
        }
    }
    None
}

fn check(sets: &BTreeSet<Set>) {
    let all: Vec<&Set> = sets.iter().collect();
    let faults: Vec<String> = all.par_iter().filter_map(|set| fault(set)).collect();
    let shown = faults
        .iter()
        .take(8)
        .cloned()
        .collect::<Vec<_>>()
        .join("\n");
    assert!(
        faults.is_empty(),
        "{} of {} sets:\n{shown}",
        faults.len(),
        sets.len()
    );
}

#[test]
fn the_table_is_the_one_tested() {
    let (scene, settings) = asking_for(&completed([]));
    let placement = Placement::new(&scene, settings.width, settings.height);
    let effects = Effects::derive(&scene, &placement, &settings);
    let names: Vec<&str> = effects.table().iter().map(|e| e.name).collect();
    assert_eq!(names, ALL);
}

#[test]
fn each_effect_alone() {
    let mut sets: BTreeSet<Set> = ALL.iter().map(|name| completed([*name])).collect();
    sets.extend(
        ALL.iter()
            .map(|name| completed([*name, "list"]))
            .filter(possible),
    );
    check(&sets);
}

#[test]
fn all_pairs() {
    let mut sets = BTreeSet::new();
    let mut impossible = 0;
    for (i, a) in ALL.iter().enumerate() {
        for b in &ALL[i + 1..] {
            let set = completed([*a, *b]);
            if possible(&set) {
                sets.insert(set);
            } else {
                impossible += 1;
            }
        }
    }
    // And a straddled lamp with any of the four effects of light sampling, and a room with a sky.
    assert_eq!(impossible, EXCLUSIVE.len() + 5);
    check(&sets);
}

/// All effects that can be in use together, for both geometries, both integrators, and every way
/// to leave a surface.
fn largest() -> Vec<Set> {
    let mut sets = Vec::new();
    for form in ["baked", "list"] {
        for lecture in [false, true] {
            for exit in ["nested", "nudge", "ulp"] {
                let other = |name: &&str| match *name {
                    "baked" | "list" => *name == form,
                    "lecture" => lecture,
                    "bsdf" | "roulette" | "mis" => !lecture,
                    // See `possible`.
                    "lights" | "projected" | "table" => !lecture,
                    "straddle" => lecture || exit != "nested",
                    "nested" | "nudge" | "ulp" => *name == exit,
                    _ => true,
                };
                sets.push(ALL.into_iter().filter(other).collect());
            }
        }
    }
    sets
}

#[test]
fn all_and_all_but_one() {
    let mut sets = BTreeSet::new();
    for all in largest() {
        for left_out in &all {
            let rest = completed(all.iter().copied().filter(|name| name != left_out));
            // What needs it goes with it.
            let needed = rest.contains(left_out);
            let rest = if needed && *left_out == "interior" {
                let inside = [
                    "interior",
                    "dielectric",
                    "straddle",
                    "nested",
                    "nudge",
                    "ulp",
                ];
                completed(all.iter().copied().filter(|n| !inside.contains(n)))
            } else {
                rest
            };
            // Without the nudge, a lamp that the lens straddles is left: see `possible`.
            if possible(&rest) {
                sets.insert(rest);
            }
        }
        sets.insert(all);
    }
    check(&sets);
}

#[test]
fn every_possible_set() {
    let subset = |names: &[&'static str], bits: u32| {
        let chosen = names.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1);
        completed(chosen.map(|(_, n)| *n))
    };
    // Of sets with the rare ones, there are too many to link them all in a minute.
    let rare = [
        "straddle",
        "nested",
        "nudge",
        "ulp",
        "lights",
        "projected",
        "table",
        "mis",
        "sobol",
        "adaptive",
        "classes",
        "features",
    ];
    let common: Vec<&'static str> = ALL.into_iter().filter(|n| !rare.contains(n)).collect();
    let every = (0..1 << common.len()).map(|bits| subset(&common, bits));
    let some = (0..4000u32).map(|i| subset(&ALL, i.wrapping_mul(0x9e37_79b9) >> (32 - ALL.len())));
    let sets: BTreeSet<Set> = every.chain(some).filter(possible).collect();
    eprintln!("{} sets", sets.len());
    check(&sets);
}

#[test]
fn every_set_in_the_scenes() {
    // As they are, and with the other geometry and integrator.
    let jobs: Vec<_> = scene_files()
        .into_iter()
        .flat_map(|path| {
            [
                (path.clone(), 0),
                (path.clone(), 1),
                (path.clone(), 2),
                (path, 3),
            ]
        })
        .collect();
    let faults: Vec<String> = jobs
        .par_iter()
        .filter_map(|(path, variant)| {
            let scene = scene_file(path);
            let mut settings = Settings::for_scene(&scene);
            match variant {
                1 => settings.geometry = GeometryChoice::List,
                2 => settings.integrator = Integrator::Lecture { termination: 0.2 },
                3 => settings.roulette = false,
                _ => {}
            }
            let placement = Placement::new(&scene, settings.width, settings.height);
            let effects = Effects::derive(&scene, &placement, &settings);
            fault_of(&scene, &placement, &effects, false)
                .map(|f| format!("{}: {f}", path.display()))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn companion_the_search_finds() {
    // A kernel with everything against a table with nothing, and the other way round: every word
    // is found, and its absence is.
    let [full, ..] = &largest()[..] else {
        panic!("no largest set")
    };
    let (scene, settings) = asking_for(full);
    let placement = Placement::new(&scene, settings.width, settings.height);
    let kernel = |names: &[&str]| {
        let effects = Effects::of(&scene, &placement, &settings, names);
        link(Stage::Path, &scene, &placement, &effects).map(|k| k.wgsl)
    };
    let names: Vec<&str> = full.iter().copied().collect();
    let wgsl = kernel(&names).unwrap_or_else(|e| panic!("{e}"));
    for word in names.iter().filter(|n| WORDS.contains(n)) {
        let without: Vec<&str> = names.iter().copied().filter(|n| n != word).collect();
        let effects = Effects::of(&scene, &placement, &settings, &without);
        let found = wrong_words(&wgsl, &effects);
        assert!(
            found.as_ref().is_some_and(|f| f.contains("occurs")),
            "{word}: {found:?}"
        );
        let alone = Effects::of(&scene, &placement, &settings, &[word]);
        let missing = wrong_words("fn main() {}", &alone);
        assert!(
            missing
                .as_ref()
                .is_some_and(|f| f.contains("does not occur")),
            "{missing:?}"
        );
    }
}
