//! The kernel holds the effects in use, and nothing of the others: every set links, is valid, and declares
//! the names of its effects alone.
//!
//! The sets follow from the table: each effect alone, each two, as many as can be together and these without
//! one, those of all scenes, and a random sample of the rest, all completed by what their effects need.

mod asking;
mod links;
mod state;

use crate::common::{scene_file, scene_files};
use crate::thorough::thorough;
use gpu_trace::effects::{Effect, Effects, Shared, completed, table};
use gpu_trace::materials::texturable::textured_keys;
use gpu_trace::placement::Placement;
use gpu_trace::settings::{GeometryChoice, Integrator, Settings};
use gpu_trace::verify::Random;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use asking::asking_for;
use links::{Linked, check, check_probes, judged, linked, wrong_names};

type Set = BTreeSet<Effect>;

/// Sets drawn at random, in the short form and in the long one.
const SAMPLED: [usize; 2] = [60, 1500];

fn every() -> impl DoubleEndedIterator<Item = Effect> + Clone {
    table().iter().map(|row| row.effect)
}

/// `set` without an effect and all that need it.
fn without(set: &Set, effect: Effect) -> Option<Set> {
    let mut rest = set.clone();
    rest.remove(&effect);
    loop {
        let unmet = rest.iter().copied().find(|effect| {
            let lists = &effect.row().needs;
            !lists
                .iter()
                .all(|list| list.iter().any(|e| rest.contains(e)))
        });
        match unmet {
            Some(unmet) => rest.remove(&unmet),
            None => return completed(rest),
        };
    }
}

/// As many effects as can be in use together, tried in this order.
fn filled(start: Set, order: impl Iterator<Item = Effect>) -> Set {
    let mut set = start;
    for effect in order {
        let more = set.iter().copied().chain([effect]);
        if let Some(larger) = completed(more).filter(|larger| larger.is_superset(&set)) {
            set = larger;
        }
    }
    set
}

/// A few largest sets; every effect is in one.
fn largest() -> BTreeSet<Set> {
    let starts: Vec<Set> = every().filter_map(|effect| completed([effect])).collect();
    let one_way = starts.iter().map(|start| filled(start.clone(), every()));
    let other_way = starts
        .iter()
        .map(|start| filled(start.clone(), every().rev()));
    one_way.chain(other_way).collect()
}

/// The largest sets, and these without one of their effects: the short form leaves out each effect of the first set
/// that has it, the long form of all.
fn all_but_one() -> BTreeSet<Set> {
    let largest = largest();
    let mut sets = largest.clone();
    for effect in every() {
        let with = largest.iter().filter(|all| all.contains(&effect));
        let most = if thorough() { usize::MAX } else { 1 };
        sets.extend(with.take(most).filter_map(|all| without(all, effect)));
    }
    sets
}

fn singles() -> BTreeSet<Set> {
    let alone = every().filter_map(|effect| completed([effect]));
    let forms = [Effect::List, Effect::Bvh];
    let stored = forms.map(|form| every().filter_map(move |effect| completed([effect, form])));
    alone.chain(stored.into_iter().flatten()).collect()
}

/// All but keys as textures that are like another one: a colour, a number and emission stand for them all here, where
/// sets are many.
fn unlike() -> impl Iterator<Item = Effect> + Clone {
    let alike = |effect: &Effect| match effect {
        Effect::Textured(number) => {
            let key = textured_keys()[*number as usize];
            !["albedo", "roughness", "emission"].contains(&key)
        }
        _ => false,
    };
    every().filter(move |effect| !alike(effect))
}

fn pairs() -> BTreeSet<Set> {
    unlike()
        .flat_map(|a| unlike().map(move |b| [a, b]))
        .filter(|[a, b]| a < b)
        .filter_map(completed)
        .collect()
}

#[test]
fn the_table_can_be_fulfilled() {
    // No effect excludes what it needs; the codes and names are each other's.
    for row in table() {
        assert!(completed([row.effect]).is_some(), "{}", row.name);
        assert_eq!(Effect::named(row.name), Some(row.effect));
        let rows = table().iter().filter(|other| other.name == row.name);
        assert_eq!(rows.count(), 1, "{}", row.name);
    }
    let all: Set = largest().into_iter().flatten().collect();
    assert_eq!(all, every().collect());
}

#[test]
fn probes_link() {
    let mut sets = singles();
    sets.extend(largest());
    check_probes(&sets);
}

#[test]
fn each_effect_alone() {
    for (set, linked) in check(&singles()) {
        let (scene, settings) = asking_for(&set);
        let placement =
            Placement::with_offset(&scene, settings.width, settings.height, settings.offset);
        let derived = Effects::derive(&scene, &placement, &settings);
        let names: Vec<&str> = derived.names().collect();
        assert!(linked.asked_for, "{set:?}: the scene asks for {names:?}");
    }
}

#[test]
fn all_pairs() {
    let sets = pairs();
    let all = check(&sets);
    // Few pairs have no scene that asks for them: a lamp that the lens straddles, a room with a sky.
    let asked_for = all.iter().filter(|(_, linked)| linked.asked_for).count();
    assert!(
        10 * asked_for >= 9 * all.len(),
        "{asked_for} of {}",
        all.len()
    );
}

#[test]
fn all_and_all_but_one() {
    check(&all_but_one());
}

#[test]
fn a_sample_of_the_rest() {
    let mut random = Random::new("sets of effects");
    let mut sets = BTreeSet::new();
    while sets.len() < SAMPLED[usize::from(thorough())] {
        // From sparse to dense, in any order.
        let share = random.range(0.1, 0.9);
        let mut order: Vec<(f64, Effect)> = every().map(|e| (random.unit(), e)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let chosen = order.into_iter().map(|(_, effect)| effect);
        let chosen: Vec<Effect> = chosen.filter(|_| random.unit() < share).collect();
        let start = completed([]).expect("nothing excludes nothing");
        sets.insert(filled(start, chosen.into_iter()));
    }
    check(&sets);
}

#[test]
fn every_set_in_the_scenes() {
    // As they are, and with the other geometries and integrator.
    let jobs: Vec<_> = scene_files()
        .into_iter()
        .flat_map(|path| (0..5).map(move |variant| (path.clone(), variant)))
        .collect();
    let faults: Vec<String> = jobs
        .par_iter()
        .filter_map(|(path, variant)| {
            let scene = scene_file(path);
            let mut settings = Settings::for_scene(&scene);
            match variant {
                1 => settings.geometry = GeometryChoice::List,
                2 => settings.integrator = Integrator::Lecture { termination: 0.2 },
                3 => settings.roulette = Some(false),
                4 => settings.geometry = GeometryChoice::Bvh,
                _ => {}
            }
            let placement = Placement::new(&scene, settings.width, settings.height);
            let effects = Effects::derive(&scene, &placement, &settings);
            let set: Set = effects.used().collect();
            if completed(set.iter().copied()) != Some(set) {
                return Some(format!("{}: not as the table says", path.display()));
            }
            let (_, fault) = judged(&scene, &placement, &effects);
            fault.map(|fault| format!("{}: {fault}", path.display()))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Names in modules, and members, that came with the same effects every time and that none of these has for
/// its own. What functions declare within them goes with them.
fn unmarked(all: &[(Set, Arc<Linked>)]) -> BTreeMap<&str, Set> {
    let mut with: BTreeMap<&str, Set> = BTreeMap::new();
    for (set, linked) in all {
        for name in &linked.names {
            with.entry(name)
                .and_modify(|common| common.retain(|effect| set.contains(effect)))
                .or_insert_with(|| set.clone());
        }
    }
    with.retain(|name, effects| {
        let marked = effects.iter().any(|effect| effect.row().is_marked(name));
        // Those of a material's module are its own; the dispatch is that of what is in use, and so are the
        // members of `Material`: see records/material.rs.
        let of_material = name.starts_with("materials::") || name.starts_with("bsdf::");
        let shared = Shared::ALL.iter().any(|shared| shared.is_marked(name));
        !effects.is_empty() && !marked && !of_material && !shared && name.contains("::")
    });
    with
}

#[test]
fn what_comes_with_an_effect_is_its_own() {
    let mut sets = singles();
    sets.extend(all_but_one());
    let all = check(&sets);
    let declared = unmarked(&all);
    assert!(declared.is_empty(), "{declared:#?}");
}

#[test]
fn companion_traces_are_found() {
    // A kernel with everything against a table with less, and the other way round.
    for set in largest() {
        let names = &linked(&set).names;
        for effect in &set {
            let rest: Vec<Effect> = set.iter().copied().filter(|e| e != effect).collect();
            let found = wrong_names(names, &Effects::of(&rest));
            let marked = !effect.row().marks.is_empty();
            assert_eq!(found.is_some(), marked, "{effect:?}: {found:?}");
            let alone = Effects::of(&[*effect]);
            let missing = wrong_names(&BTreeSet::new(), &alone);
            assert_eq!(missing.is_some(), marked, "{effect:?}: {missing:?}");
        }
    }
}
