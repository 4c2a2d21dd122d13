//! Kernels of sets of effects, and what is wrong with the names in them.

use super::Set;
use super::asking::asking_for;
use gpu_trace::effects::{Effects, Shared, table};
use gpu_trace::materials::ALL;
use gpu_trace::placement::Placement;
use gpu_trace::scene::Scene;
use gpu_trace::shader::{Folder, Stage, declared_names, link};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};

/// A set's kernel, the names in it, and what is wrong with it, if anything is.
pub(super) struct Linked {
    pub(super) asked_for: bool,
    pub(super) names: BTreeSet<String>,
    pub(super) fault: Option<String>,
}

/// Links a set, once for all tests. Its scene asks for it, or, where no scene does, for nearly it.
pub(super) fn linked(set: &Set) -> Arc<Linked> {
    static ALL: Mutex<BTreeMap<Set, Arc<Linked>>> = Mutex::new(BTreeMap::new());
    let known = ALL.lock().expect("no test panics here").get(set).cloned();
    known.unwrap_or_else(|| {
        let linked = Arc::new(link_set(set));
        let mut all = ALL.lock().expect("no test panics here");
        all.insert(set.clone(), linked.clone());
        linked
    })
}

fn link_set(set: &Set) -> Linked {
    let (scene, settings) = asking_for(set);
    let placement =
        Placement::with_offset(&scene, settings.width, settings.height, settings.offset);
    let derived: Set = Effects::derive(&scene, &placement, &settings)
        .used()
        .collect();
    let effects = Effects::of(&set.iter().copied().collect::<Vec<_>>());
    let (names, fault) = judged(&scene, &placement, &effects);
    Linked {
        asked_for: derived == *set,
        names,
        fault,
    }
}

pub(super) fn judged(
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
) -> (BTreeSet<String>, Option<String>) {
    let set: Vec<&str> = effects.names().collect();
    let fault = |what: String| Some(format!("{set:?}: {what}"));
    match link(Stage::Path, scene, placement, effects) {
        Err(e) => (BTreeSet::new(), fault(e.to_string())),
        Ok(kernel) => {
            let names = declared_names(&kernel.module);
            let wrong = wrong_names(&names, effects).and_then(fault);
            (names, wrong)
        }
    }
}

/// Links the probe of each set.
pub(super) fn check_probes(sets: &BTreeSet<Set>) {
    let faults: Vec<String> = sets
        .par_iter()
        .filter_map(|set| {
            let (scene, settings) = asking_for(set);
            let placement = Placement::new(&scene, settings.width, settings.height);
            let effects = Effects::of(&set.iter().copied().collect::<Vec<_>>());
            let linked = |folder| link(Stage::Probe(folder), &scene, &placement, &effects);
            let fault = Folder::ALL
                .into_iter()
                .find_map(|folder| linked(folder).err());
            fault.map(|e| format!("{set:?}: {e}"))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A name that is there and should not be, or the other way round.
pub(super) fn wrong_names(names: &BTreeSet<String>, effects: &Effects) -> Option<String> {
    let used: Set = effects.used().collect();
    for row in table() {
        let found = names.iter().find(|name| row.is_marked(name));
        match (used.contains(&row.effect), found) {
            (false, Some(name)) => return Some(format!("{} left {name}", row.name)),
            (true, None) if !row.marks.is_empty() => {
                return Some(format!("nothing of {} is there", row.name));
            }
            _ => {}
        }
    }
    for shared in Shared::ALL {
        let found = names.iter().find(|name| shared.is_marked(name));
        if found.is_some() != (shared.is_used)(effects) {
            return Some(format!("{}: {found:?}", shared.what));
        }
    }
    for material in ALL {
        let module = format!("materials::{}::", material.module);
        let in_use = effects
            .forms()
            .any(|(_, form)| material.forms.contains(form));
        let found = names.iter().find(|name| name.starts_with(&module));
        if found.is_some() != in_use {
            return Some(format!("{}, used {in_use}: {found:?}", material.name));
        }
    }
    // What plays a role is in the kernel by the role's name only.
    let files = effects.roles().into_iter().filter_map(|role| role.file);
    files
        .map(|file| format!("{}::", file.replace('/', "::")))
        .find_map(|path| names.iter().find(|name| name.starts_with(&path)).cloned())
}

/// Links all sets; none may be faulty.
pub(super) fn check(sets: &BTreeSet<Set>) -> Vec<(Set, Arc<Linked>)> {
    let all: Vec<(Set, Arc<Linked>)> = sets
        .par_iter()
        .map(|set| (set.clone(), linked(set)))
        .collect();
    let faults: Vec<&str> = all.iter().filter_map(|(_, l)| l.fault.as_deref()).collect();
    let shown = faults[..faults.len().min(8)].join("\n");
    let (bad, total) = (faults.len(), all.len());
    let asked_for = all.iter().filter(|(_, linked)| linked.asked_for).count();
    eprintln!("{total} sets, {asked_for} of them as their scene asks for");
    assert!(bad == 0, "{bad} of {total} sets:\n{shown}");
    all
}
