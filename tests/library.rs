//! What the command line refuses, and a caller of the library does not get past either.

use std::collections::BTreeMap;

use crate::common::{gpu, job, scene_file};
use gpu_trace::backend::cpu::ReferenceRenderer;
use gpu_trace::backend::{Backend, BackendChoice, BackendKind};
use gpu_trace::choice::{Candidate, Open};
use gpu_trace::effects::{Effect, completed, conflict};
use gpu_trace::error::{Error, Result};
use gpu_trace::film_file::{self, Choices};
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::image::{Format, Picture};
use gpu_trace::input::{Encoding, Input};
use gpu_trace::output::{Aov, Target, check_layers};
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::{Loaded, builtin};
use gpu_trace::settings::{
    GeometryChoice, Integrator, LightSampling, Offset, Rect, Settings, View,
};
use gpu_trace::study::identity::{Identity, ReferenceIdentity};
use gpu_trace::study::plan::{ReferenceChoice, Study};
use gpu_trace::study::run::Length;
use gpu_trace::study::series::{Series, Subject};
use gpu_trace::variance::VarianceClass;
use gpu_trace::verify::settings;

/// That it is refused, in these words.
fn refused<T>(result: Result<T>, part: &str) {
    match result {
        Err(Error::Usage(text)) => assert!(text.contains(part), "{part}: {text}"),
        Err(other) => panic!("{part}: {other:?}"),
        Ok(_) => panic!("{part}: it is not refused"),
    }
}

#[test]
fn the_reference_has_no_view_of_a_tree() {
    let scene = scene_file("scenes/lecture.toml");
    let view = Settings {
        view: Some(View::BvhCost),
        geometry: GeometryChoice::Bvh,
        ..settings(&scene, 16, 16, 16)
    };
    let light = Settings {
        view: None,
        ..view.clone()
    };
    let refusal = "--view bvh-cost: the CPU reference has no tree";
    refused(ReferenceRenderer::new(&job(&scene, &view), 1), refusal);
    let cpu = Backend::Cpu { threads: 1 };
    refused(cpu.renderer(&job(&scene, &view)), refusal);
    assert!(ReferenceRenderer::new(&job(&scene, &light), 1).is_ok());
    assert!(GpuRenderer::new(gpu(), &job(&scene, &view)).is_ok());
}

#[test]
fn an_image_beyond_the_memory_is_refused_by_every_renderer() {
    let scene = scene_file("scenes/lecture.toml");
    let large = job(&scene, &settings(&scene, 65_536, 65_536, 16));
    let part = Settings {
        crop: Rect {
            x: 40_000,
            y: 30_000,
            width: 8,
            height: 8,
        },
        ..large.settings().clone()
    };
    let part = job(&scene, &part);
    refused(ReferenceRenderer::new(&large, 1), "GiB of memory");
    refused(GpuRenderer::new(gpu(), &large), "GiB of memory");
    assert!(ReferenceRenderer::new(&part, 1).is_ok());
    assert!(GpuRenderer::new(gpu(), &part).is_ok());
}

#[test]
fn a_gpu_has_a_name_only_where_one_is_used() {
    let choice = BackendChoice {
        kind: Some(BackendKind::Cpu),
        device: Some("0"),
        threads: 1,
    };
    let refusal = "--device chooses a GPU, --backend cpu uses none";
    refused(Backend::open(&choice, &mut Vec::new()), refusal);
    let without = BackendChoice {
        device: None,
        ..choice
    };
    assert!(Backend::open(&without, &mut Vec::new()).is_ok());
}

#[test]
fn a_film_file_keeps_light() {
    let scene = scene_file("scenes/lecture.toml");
    let light = settings(&scene, 16, 16, 16);
    let view = Settings {
        view: Some(View::BvhCost),
        ..light.clone()
    };
    let refusal = "--checkpoint keeps light, and --view bvh-cost is none";
    refused(film_file::check(&view), refusal);
    refused(Choices::of(&view), refusal);
    assert!(Choices::of(&light).is_ok());
}

#[test]
fn layers_need_room() {
    let targets = |names: &[&str]| -> Vec<Target> {
        let targets = names.iter().map(|name| Target::parse(*name));
        targets.collect::<Result<_>>().expect("names of images")
    };
    let few = targets(&["a.png", "a.npy"]);
    refused(
        check_layers(&[Aov::Normal], &few),
        "--aov: only EXR files have room for layers",
    );
    assert!(check_layers::<Aov>(&[], &few).is_ok());
    assert!(check_layers(&[Aov::Normal], &targets(&["a.png", "a.exr"])).is_ok());
}

#[test]
fn effects_are_forced_only_with_what_they_need() {
    let scene = scene_file("scenes/lecture.toml");
    let bsdf = Settings {
        integrator: Integrator::Bsdf,
        ..settings(&scene, 16, 16, 16)
    };
    let job = job(&scene, &bsdf);
    let with = |more: &[Effect]| job.clone().with_effects(more, "forced");
    refused(with(&[Effect::Mis]), "mis needs lights or skylight");
    refused(with(&[Effect::Bvh]), "bvh and baked are not in one kernel");
    // Excluded by what is there.
    refused(
        with(&[Effect::Lecture]),
        "lecture and roulette are not in one kernel",
    );
    let lens = with(&[Effect::Lens]).unwrap_or_else(|e| panic!("{e}"));
    assert!(lens.effects().has(Effect::Lens) && !job.effects().has(Effect::Lens));
    // A set that is complete conflicts with nothing, and has what it began with.
    for effect in gpu_trace::effects::table().iter().map(|row| row.effect) {
        let set = completed([effect]).expect("a kernel with it");
        let set: Vec<Effect> = set.into_iter().collect();
        assert!(set.contains(&effect));
        assert_eq!(conflict(&[], &set), None, "{}", effect.name());
    }
}

#[test]
fn what_may_be_chosen_follows_from_the_settings() {
    let scene = scene_file("scenes/lecture.toml");
    let path = settings(&scene, 16, 16, 16);
    let rivals = |integrator, radiance_cache, settings: &Settings| {
        let open = Open {
            integrator,
            radiance_cache,
        };
        open.rivals(settings)
    };
    let [bsdf, cache] = [Candidate::Bsdf, Candidate::RadianceCache];
    assert_eq!(rivals(true, true, &path), [bsdf, cache]);
    assert_eq!(rivals(true, false, &path), [bsdf]);
    assert_eq!(rivals(false, true, &path), [cache]);
    assert_eq!(rivals(false, false, &path), []);
    // Who says how lights are sampled wants that.
    let sampled = Settings {
        light_sampling: Some(LightSampling::Projected),
        ..path.clone()
    };
    assert_eq!(rivals(true, false, &sampled), []);
    let cached = Settings {
        radiance_cache: true,
        ..path.clone()
    };
    assert_eq!(rivals(true, false, &cached), []);
    let nee = Settings {
        integrator: Integrator::Nee,
        ..path
    };
    assert_eq!(rivals(false, true, &nee), []);
}

const SIZE: [u32; 2] = [16, 12];

fn reference() -> Input {
    let [width, height] = SIZE;
    Input {
        path: "reference.exr".into(),
        format: Format::Exr,
        encoding: Encoding::Linear,
        picture: Picture::new(width, height, vec![[0.5; 3]; (width * height) as usize]),
        stderr: None,
        about: BTreeMap::new(),
        notes: Vec::new(),
    }
}

fn series(radiance_cache: bool) -> Series {
    Series {
        integrator: Integrator::Path,
        sampler: Sampler::Sobol,
        backend: BackendKind::Cpu,
        offset: Offset::Exact,
        max_bounces: 64,
        radiance_cache,
    }
}

/// A study of a scene with that reference.
fn study(loaded: Loaded, reference: ReferenceChoice, radiance_cache: bool) -> Study {
    let [width, height] = SIZE;
    let subject = Subject {
        series: series(radiance_cache),
        variance: VarianceClass::Finite,
    };
    let identity = Identity {
        version: "1".into(),
        scene: loaded.name.clone(),
        scene_hash: loaded.hash.clone(),
        size: SIZE,
        spp: 64,
        time: None,
        reference: ReferenceIdentity::File {
            path: "reference.exr".into(),
            hash: "0".into(),
        },
        threads: 0,
        gpu: None,
        kernels: BTreeMap::new(),
    };
    Study {
        title: "a study".into(),
        subjects: vec![subject],
        base: settings(&loaded.scene, width, height, 64),
        seeds: 3..7,
        length: Length {
            spp: 64,
            seconds: None,
        },
        reference,
        shown: Vec::new(),
        exposure: 0.0,
        command: String::new(),
        identity,
        loaded,
    }
}

#[test]
fn a_study_is_checked_before_it_is_conducted() {
    let loaded = |name: &str| builtin::resolve(Some(name)).unwrap_or_else(|e| panic!("{e}"));
    let with = |change: fn(&mut Input)| {
        let mut input = reference();
        change(&mut input);
        let choice = ReferenceChoice::File(Box::new(input));
        study(loaded("lecture"), choice, false).check()
    };
    assert!(with(|_| {}).is_ok());
    refused(
        with(|input| input.picture = Picture::new(1, 1, vec![[0.5; 3]])),
        "the sizes differ: reference.exr has 1x1 pixels, the study 16x12",
    );
    refused(
        with(|input| input.format = Format::Png),
        "reference.exr is a PNG file",
    );
    refused(
        with(|input| _ = input.about.insert("scene_hash".into(), "0".into())),
        "the scenes differ: reference.exr shows ? (0), the study is of lecture",
    );
    let seeded = |seed: &str| {
        let mut input = reference();
        input.about.insert("seed".into(), seed.into());
        let choice = ReferenceChoice::File(Box::new(input));
        study(loaded("lecture"), choice, false).check()
    };
    refused(
        seeded("3"),
        "reference.exr was rendered with seed 3, and the study has seeds 3 to 6",
    );
    assert!(seeded("7").is_ok());
    let own = |seed| {
        let series = series(false);
        let choice = ReferenceChoice::Own {
            series,
            spp: 64,
            seed,
        };
        study(loaded("lecture"), choice, false).check()
    };
    refused(own(6), "the reference was rendered with seed 6");
    assert!(own(u64::MAX).is_ok());
    // So many spheres are in a tree.
    let cached = |name| {
        let choice = ReferenceChoice::File(Box::new(reference()));
        study(loaded(name), choice, true).check()
    };
    refused(
        cached("field"),
        "--radiance-cache on: field cannot have one: ",
    );
    assert!(cached("lecture").is_ok());
}
