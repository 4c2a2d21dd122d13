//! What effects cost: `gpu-trace effects --measure`.

use gpu_trace::backend::{Backend, BackendChoice};
use gpu_trace::effects::{Effect, table};
use gpu_trace::film::Film;
use gpu_trace::job::{Job, prepare};
use gpu_trace::prices::{
    Effort, Price, PriceList, Watch, alternative, forced, is_absent, measure, smaller, standard,
};
use gpu_trace::render::render_quietly;
use gpu_trace::scene::builtin;
use gpu_trace::settings::{Rect, Settings};
use gpu_trace::shader::{Stage, link, link_without};

use crate::common::images::assert_alike;
use crate::thorough::thorough;

/// Effects that follow from where spheres are, and one that the command asks for: nothing is in their place, and no
/// standard scene asks for them.
const WITHOUT_ALTERNATIVE: [Effect; 6] = [
    Effect::Pole,
    Effect::Interior,
    Effect::Straddle,
    Effect::Nested,
    Effect::Priority,
    Effect::Adaptive,
];

/// As little as can be measured.
const QUICK: Effort = Effort {
    rounds: 2,
    turn: 0.0,
};

struct Quiet {
    /// Parts that are begun before it says to stop.
    left: usize,
}

impl Watch for Quiet {
    fn begin(&mut self, _: &str, _: usize, _: usize) {
        self.left = self.left.saturating_sub(1);
    }

    fn goes_on(&self) -> bool {
        self.left > 0
    }
}

fn job(scene: &str) -> Job {
    let scene = builtin::resolve(Some(scene)).expect("a scene").scene;
    let settings = Settings::for_scene(&scene);
    prepare(&scene, &settings).expect("a job")
}

fn scenes() -> Vec<&'static str> {
    if thorough() {
        return builtin::names().collect();
    }
    vec!["lecture", "frosted-glass"]
}

#[test]
fn what_is_left_out_is_in_no_kernel() {
    for scene in scenes() {
        let job = job(scene);
        let (mut absent, mut present) = (0, 0);
        for (row, reasons) in job.effects().rows() {
            if reasons.is_empty() {
                let is_absent = is_absent(&job, row.effect);
                assert!(is_absent.expect("a kernel"), "{scene}: {}", row.name);
                absent += 1;
                continue;
            }
            // Without its own sources a kernel that has it is another one, or none.
            let (placement, effects) = (job.placement(), job.effects());
            let own = link(Stage::Path, job.scene(), placement, effects).expect("a kernel");
            let without = link_without(row.effect, job.scene(), placement, effects);
            let same = without.is_ok_and(|without| without.wgsl == own.wgsl);
            // The module of constants is written for the scene: it has no source.
            let written = [Effect::Baked].contains(&row.effect);
            assert!(!same || written, "{scene}: {} has no source", row.name);
            present += 1;
        }
        assert!(absent > 20 && present > 5, "{scene}: {absent}, {present}");
    }
}

#[test]
fn standard_scenes_ask_for_their_effects() {
    for row in table() {
        let (scene, settings) = standard(row.effect);
        let job = prepare(&scene, &settings).unwrap_or_else(|e| panic!("{}: {e}", row.name));
        let asked = job.effects().has(row.effect);
        let expected = !WITHOUT_ALTERNATIVE.contains(&row.effect);
        assert_eq!(asked, expected, "{}", row.name);
        if !asked {
            continue;
        }
        // In its alternative the effect is gone.
        match alternative(&job, row.effect) {
            Ok(other) => assert!(!other.job.effects().has(row.effect), "{}", row.name),
            Err(why) => assert_eq!(row.name, "diffuse", "{why}"),
        }
    }
}

#[test]
fn what_is_forced_links() {
    let job = job("lecture");
    let mut forcible = 0;
    for (row, _) in job.effects().rows().filter(|(_, r)| r.is_empty()) {
        match forced(&job, row.effect) {
            Ok(with) => {
                let kernel = link(Stage::Path, with.scene(), with.placement(), with.effects());
                kernel.unwrap_or_else(|e| panic!("{}: {e}", row.name));
                assert!(with.effects().has(row.effect));
                forcible += 1;
            }
            Err(why) => {
                let known = ["not in one kernel", "would be in use", "the scene has not"];
                let known = known.iter().any(|reason| why.contains(reason));
                assert!(known, "{}: {why}", row.name);
            }
        }
    }
    assert!(forcible > 15, "{forcible}");
}

/// A small image.
fn image(job: &Job) -> Film {
    let mut warnings = Vec::new();
    let backend = Backend::open(&BackendChoice::default(), &mut warnings).expect("a device");
    let mut renderer = backend.renderer(job).expect("a renderer");
    let film = render_quietly(renderer.as_mut(), job.settings());
    film.expect("an image").film
}

/// The share of the pixels of which a channel differs by more than a hundred thousandth.
fn differing(a: &Film, b: &Film) -> f64 {
    let differ = |i: &usize| {
        let (a, b) = (a.mean(*i), b.mean(*i));
        (0..3).any(|c| (a[c] - b[c]).abs() > 1e-5 * a[c].abs().max(1e-3))
    };
    let pixels = a.rect().pixels();
    (0..pixels).filter(differ).count() as f64 / pixels as f64
}

/// A kernel of what the scene asks for and one of everything make the same image; in the long form, one of each
/// other effect does, too.
#[test]
fn unused_effects_change_no_image() {
    let scene = builtin::resolve(Some("lecture")).expect("a scene").scene;
    let mut settings = Settings {
        width: 32,
        height: 32,
        samples: 0..16,
        ..Settings::for_scene(&scene)
    };
    (settings.crop.width, settings.crop.height) = (32, 32);
    let own = prepare(&scene, &settings).expect("a job");
    let expected = image(&own);
    let mut full = own.clone();
    for row in table().iter().filter(|row| !own.effects().has(row.effect)) {
        if let Ok(with) = forced(&full, row.effect) {
            full = with;
        }
        if thorough()
            && let Ok(with) = forced(&own, row.effect)
        {
            let film = image(&with);
            let share = differing(&expected, &film);
            let name = format!("with {}", row.name);
            assert_alike(&name, &film, &expected, share <= 0.001, share);
        }
    }
    assert!(full.effects().used().count() > own.effects().used().count() + 15);
    let film = image(&full);
    let share = differing(&expected, &film);
    assert_alike("all effects", &film, &expected, share <= 0.001, share);
    // The companion: other samples are another image.
    let other = Settings {
        seed: 1,
        ..settings
    };
    let other = image(&prepare(&scene, &other).expect("a job"));
    assert!(differing(&expected, &other) > 0.9);
}

fn measured(scene: &str, parts: usize) -> PriceList {
    measured_with(scene, parts, |_| {})
}

fn measured_with(scene: &str, parts: usize, change: impl Fn(&mut Settings)) -> PriceList {
    let mut warnings = Vec::new();
    let backend = Backend::open(&BackendChoice::default(), &mut warnings).expect("a device");
    let scene = builtin::resolve(Some(scene)).expect("a scene").scene;
    let mut settings = Settings {
        width: 16,
        height: 16,
        crop: Rect::whole(16, 16),
        ..Settings::for_scene(&scene)
    };
    change(&mut settings);
    let mut watch = Quiet { left: parts };
    measure(
        &backend,
        &scene,
        &smaller(&settings),
        true,
        QUICK,
        &mut watch,
    )
    .expect("prices")
}

#[test]
fn every_effect_has_a_price_or_a_reason() {
    let list = measured("lecture", usize::MAX);
    assert!(!list.interrupted);
    for Price {
        effect,
        reasons,
        against,
        absent,
        forced,
    } in &list.prices
    {
        let name = effect.name();
        if reasons.is_empty() {
            assert_eq!((against.is_none(), *absent), (true, Some(true)), "{name}");
            assert!(forced.is_some(), "{name}");
        } else {
            let told = against.as_ref().expect(name);
            if let Ok(against) = told {
                let cost = against.difference.cost;
                let [low, high] = cost.interval;
                assert!(low <= cost.price && cost.price <= high, "{name}: {cost:?}");
                let difference = cost.with - cost.against - cost.price;
                assert!(difference.abs() <= 1e-9 * cost.with, "{name}: {cost:?}");
            }
        }
    }
    let lines = |name: &str| {
        let price = list.prices.iter().find(|price| price.effect.name() == name);
        let against = price.and_then(|price| price.against.clone());
        against.expect(name).expect(name).difference.kernel_lines
    };
    assert!(lines("lights") > 50 && lines("roulette") > 0);
}

#[test]
fn what_was_measured_before_a_stop_is_kept() {
    let list = measured("lecture", 3);
    assert!(list.interrupted);
    let told = |price: &&Price| price.against.is_some() || price.forced.is_some();
    let told = list.prices.iter().filter(told).count();
    assert!((1..=3).contains(&told), "{told}");
}

/// Which has no radiance cache: what is measured is what is rendered.
#[test]
fn what_is_asked_for_without_effect_is_not_measured() {
    let has = |adaptive: bool| {
        let list = measured_with("lecture", 2, |settings| {
            (settings.adaptive, settings.radiance_cache) = (adaptive, true);
        });
        [Effect::Adaptive, Effect::RadianceCache].map(|effect| {
            let price = list.prices.iter().find(|price| price.effect == effect);
            !price.expect("a row").reasons.is_empty()
        })
    };
    assert_eq!(has(true), [true, false]);
    // Companion: without what stands against it it is there.
    assert_eq!(has(false), [false, true]);
}
