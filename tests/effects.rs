//! The kernel holds the effects in use, and nothing of the others: every set links, is valid, and declares
//! the names of its effects alone.
//!
//! The sets follow from the table: each effect alone, each two, as many as can be together and these without
//! one, those of all scenes, and a random sample of the rest, all completed by what their effects need.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};

use crate::common::{scene_file, scene_files};
use crate::thorough::thorough;
use glam::{DVec2, DVec3};
use gpu_trace::effects::{self, Effect, Effects, table};
use gpu_trace::image::Picture;
use gpu_trace::materials::texturable::{texturable_key, textured_keys};
use gpu_trace::materials::{ALL, Material, MaterialKind, Texture, TextureImage, forms};
use gpu_trace::placement::Placement;
use gpu_trace::placement::lights::MOST_WEIGHED;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::{
    Camera, Environment, Gradient, Handedness, RenderDefaults, Scene, Sky, Sphere,
};
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Offset, Settings, View};
use gpu_trace::shader::{Folder, Stage, declared_names, link};
use gpu_trace::verify::Random;
use rayon::prelude::*;

type Set = BTreeSet<Effect>;

/// Sets drawn at random, in the short form and in the long one.
const SAMPLED: [usize; 2] = [60, 1500];

fn every() -> impl DoubleEndedIterator<Item = Effect> + Clone {
    table().iter().map(|row| row.effect)
}

/// `set` with what its effects need, and what the scenes here have: something opaque within glass and through a lens.
/// `None` if that cannot be.
fn completed(set: impl IntoIterator<Item = Effect>) -> Option<Set> {
    let mut set: Set = set.into_iter().collect();
    if [Effect::Nested, Effect::Straddle]
        .iter()
        .any(|e| set.contains(e))
    {
        set.insert(Effect::Form(0));
    }
    effects::completed(set)
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

/// The first case of a material that has this form.
fn of_form(code: u32) -> MaterialKind {
    let cases = ALL.iter().flat_map(|material| (material.cases)());
    let mut fitting = cases.filter(|kind| kind.form() == forms()[code as usize]);
    fitting.next().expect("a case of every form")
}

/// The environment that asks for the effects of `set`.
fn environment_of(set: &Set) -> Option<Environment> {
    let radiance = DVec3::new(0.5, 0.6, 0.7);
    let has = |effect| set.contains(&effect);
    match [Effect::Environment, Effect::Gradient, Effect::Sky].map(has) {
        [true, ..] => Some(Environment::Constant(radiance)),
        [_, true, _] => Some(Environment::Gradient(Gradient {
            zenith: radiance,
            horizon: 2.0 * radiance,
            ground: 0.5 * radiance,
        })),
        [.., true] => {
            let image = Picture::new(2, 1, vec![[0.5, 0.6, 0.7], [0.0; 3]]);
            Some(Environment::Sky(Sky::new("sky", image, DVec3::ONE, 0.0)))
        }
        _ => None,
    }
}

/// For each key that is a texture in `set` a material of one of `kinds` with each kind of textures in it.
fn textured(set: &Set, kinds: &[MaterialKind]) -> Vec<Material> {
    let keys = set.iter().filter_map(|effect| match effect {
        Effect::Textured(number) => Some(textured_keys()[*number as usize]),
        _ => None,
    });
    let mut materials = Vec::new();
    for name in keys {
        let of = |kind: &MaterialKind| Some((texturable_key(kind.name(), name)?, kind.clone()));
        let Some((key, kind)) = kinds.iter().find_map(of) else {
            continue;
        };
        // What is smooth stays so.
        let smooth = name == "roughness" && kind.is_delta();
        let values = match smooth {
            true => [DVec3::ZERO; 2],
            false => [DVec3::splat(0.3), DVec3::splat(0.6)],
        };
        let image = Picture::new(2, 1, values.map(|v| v.as_vec3().to_array()).into());
        let image = TextureImage::new("image", Arc::new(image), key.number, DVec3::Y);
        let size = 0.5;
        for (effect, texture) in [
            (Effect::TextureChecker, Texture::Checker { values, size }),
            (
                Effect::TextureNoise,
                Texture::Noise {
                    values,
                    size,
                    octaves: 2,
                },
            ),
            (Effect::TextureImage, Texture::Image(image)),
        ] {
            if set.contains(&effect) {
                let plain = Material::new(&format!("{name} {effect:?}"), kind.clone());
                materials.push(plain.with_texture(key, texture));
            }
        }
    }
    materials
}

/// A scene and settings that ask for exactly the effects of `set`, where that is possible.
fn asking_for(set: &Set) -> (Scene, Settings) {
    let has = |effect| set.contains(&effect);
    let mut kinds: Vec<MaterialKind> = set
        .iter()
        .filter_map(|effect| match effect {
            Effect::Form(code) => Some(of_form(*code)),
            _ => None,
        })
        .collect();
    for kind in &mut kinds {
        let MaterialKind::Dielectric(glass) = kind else {
            continue;
        };
        if has(Effect::Absorption) {
            glass.absorption = DVec3::new(0.0, 0.1, 0.2);
        }
        if has(Effect::Dispersion) {
            glass.ior = None;
            glass.cauchy = Some(DVec2::new(1.5, 0.01));
        }
    }
    let material = |(i, kind): (usize, &MaterialKind)| Material {
        emission: DVec3::splat(if has(Effect::Emission) && i == 0 {
            2.0
        } else {
            0.0
        }),
        ..Material::new(&format!("m{i}"), kind.clone())
    };
    let glass = kinds.iter().position(|kind| kind.transmits());
    let plain = kinds.iter().enumerate().map(material);
    let materials: Vec<Material> = plain.chain(textured(set, &kinds)).collect();
    let mut spheres = Vec::new();
    let mut sphere = |material: usize, x: f64, y: f64, z: f64, radius: f64| {
        spheres.push(Sphere {
            center: DVec3::new(x, y, z),
            motion: DVec3::ZERO,
            radius,
            material,
            priority: None,
        });
    };
    // Off the view axis: what the view starts at has a pole frame.
    for i in 0..materials.len() {
        sphere(i, 2.0 * i as f64, 1.5, 0.0, 0.5);
    }
    if let Some(i) = glass {
        if has(Effect::Priority) {
            sphere(i, 2.0 * i as f64, 1.75, 0.0, 0.5);
        }
        if has(Effect::Nested) {
            sphere(0, 2.0 * i as f64, 1.5, 0.0, 0.49999);
        }
    }
    if has(Effect::Projected) && has(Effect::Table) {
        for i in 0..=MOST_WEIGHED {
            sphere(0, 0.4 * i as f64 - 1.6, 4.0, 0.0, 0.1);
        }
    }
    let nudged = has(Effect::Nudge) || has(Effect::Ulp);
    if has(Effect::Straddle) && !nudged {
        // Through the lens, with something so small and far that this one gets no pole frame.
        sphere(0, 0.0, 0.0, 0.0, 6.0);
        sphere(0, 900.0, 900.0, 0.0, 0.01);
    }
    if has(Effect::Pole) {
        sphere(0, 0.0, -10001.0, 0.0, 10000.0);
    }
    if has(Effect::Interior) && glass.is_none() && !has(Effect::Straddle) {
        // Around the camera, and too far away for a pole frame.
        sphere(0, 0.0, 0.0, 0.0, 100.0);
    }
    if has(Effect::Motion) {
        for sphere in &mut spheres {
            sphere.motion = DVec3::new(0.1, 0.0, 0.0);
        }
    }
    let scene = Scene {
        camera: Camera {
            position: DVec3::new(0.0, 0.0, 6.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            handedness: Handedness::Right,
            aperture_radius: if has(Effect::Lens) { 0.1 } else { 0.0 },
            focus_distance: 6.0,
        },
        width: 16,
        height: 16,
        render: RenderDefaults::default(),
        environment: environment_of(set),
        materials,
        spheres,
    };
    let settings = Settings {
        geometry: match [Effect::List, Effect::Bvh].map(has) {
            [true, _] => GeometryChoice::List,
            [_, true] => GeometryChoice::Bvh,
            _ => GeometryChoice::Baked,
        },
        integrator: match [
            has(Effect::Lecture),
            has(Effect::Mis),
            has(Effect::Lights) || has(Effect::Skylight),
        ] {
            [true, ..] => Integrator::Lecture { termination: 0.2 },
            [_, true, _] => Integrator::Path,
            [.., true] => Integrator::Nee,
            _ => Integrator::Bsdf,
        },
        light_sampling: (has(Effect::Lights) && !has(Effect::Projected))
            .then_some(LightSampling::Cone),
        roulette: (!has(Effect::Lecture)).then_some(has(Effect::Roulette)),
        radiance_cache: has(Effect::RadianceCache),
        adaptive: has(Effect::Adaptive),
        classes: has(Effect::Classes),
        features: has(Effect::Features),
        view: has(Effect::BvhCost).then_some(View::BvhCost),
        sampler: match has(Effect::Sobol) {
            true => Sampler::Sobol,
            false => Sampler::Independent,
        },
        offset: match [Effect::Nudge, Effect::Ulp].map(has) {
            [true, _] => Offset::Out(1.0e-4),
            [_, true] => Offset::Ulp,
            _ => Offset::Exact,
        },
        ..Settings::for_scene(&scene)
    };
    (scene, settings)
}

/// A set's kernel, the names in it, and what is wrong with it, if anything is.
struct Linked {
    asked_for: bool,
    names: BTreeSet<String>,
    fault: Option<String>,
}

/// Links a set, once for all tests. Its scene asks for it, or, where no scene does, for nearly it.
fn linked(set: &Set) -> Arc<Linked> {
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

fn judged(
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
fn check_probes(sets: &BTreeSet<Set>) {
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

/// Whether a name belongs to what all materials that transmit bring together.
fn of_media(name: &str) -> bool {
    let own = [
        "level_of",
        "runs_within",
        "TRACKED",
        "eta_scale",
        "INITIAL_WITHIN",
    ];
    let mut parts = name.split("::");
    parts.any(|part| part == "media" || own.contains(&part))
}

/// Whether a name belongs to what all light sampling brings, of lamps and of an image.
fn of_light_sampling(name: &str) -> bool {
    let own = [
        "share_of_hit",
        "share_of_light",
        "receive_direct",
        "departure",
        "lamp_hit",
        "lighting",
        "is_delta",
    ];
    let mut parts = name.split("::");
    let modules = ["light::direct::", "light::light::"];
    parts.any(|part| own.contains(&part)) || modules.iter().any(|module| name.starts_with(module))
}

/// A name that is there and should not be, or the other way round.
fn wrong_names(names: &BTreeSet<String>, effects: &Effects) -> Option<String> {
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
    let media = names.iter().find(|name| of_media(name));
    if media.is_some() != effects.transmits() {
        return Some(format!("transmits: {media:?}"));
    }
    let sampling = names.iter().find(|name| of_light_sampling(name));
    if sampling.is_some() != effects.samples_light() {
        return Some(format!("light sampling: {sampling:?}"));
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
fn check(sets: &BTreeSet<Set>) -> Vec<(Set, Arc<Linked>)> {
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
        let shared = of_media(name) || of_light_sampling(name);
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
