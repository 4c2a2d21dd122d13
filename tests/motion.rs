//! Spheres that move while the shutter is open: an image is the mean of those of all times, and what is decided before
//! a path begins holds at each.
//!
//! `scenes/tests/motion.toml` is among the scenes whose images are compared with the f64 reference (`agreement.rs`), and
//! by the tree with those by the list (`bvh.rs`).

use glam::DVec3;
use gpu_trace::error::Error;
use gpu_trace::film::Film;
use gpu_trace::job::prepare;
use gpu_trace::placement::{Placement, Side};
use gpu_trace::scene::load::load_str;
use gpu_trace::scene::motion::LONGEST_WAY;
use gpu_trace::scene::{Scene, Sphere, content_hash};
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Settings};
use gpu_trace::shader::{Stage, link};
use gpu_trace::statistics::normal_limit;
use gpu_trace::verify::{Random, settings, share_off};

use crate::cli_support::{Folder, holds};
use crate::common::blocks::Blocks;
use crate::common::images::{Left, assert_alike};
use crate::common::{job, render_cpu, render_gpu, scene, scene_file};

fn moving() -> Scene {
    scene_file("scenes/tests/motion.toml")
}

/// The scene as it is at a time, from -1/2 to 1/2.
fn at(scene: &Scene, time: f64) -> Scene {
    let mut still = scene.clone();
    for sphere in &mut still.spheres {
        sphere.center += time * sphere.motion;
        sphere.motion = DVec3::ZERO;
    }
    still
}

/// Pixels of a side of the image, and of the blocks whose means are compared.
const SIZE: u32 = 24;
const BLOCK: usize = 8;

/// The mean of the images at this many times, each with samples of its own.
fn mean_of_frames(scene: &Scene, settings: &Settings, frames: u32) -> Blocks {
    let frame = |frame: u32| {
        let time = (f64::from(frame) + 0.5) / f64::from(frames) - 0.5;
        let settings = Settings {
            seed: u64::from(frame) + 1,
            ..settings.clone()
        };
        Blocks::of(&render_gpu(&at(scene, time), &settings), BLOCK)
    };
    Blocks::mean_of(&(0..frames).map(frame).collect::<Vec<_>>())
}

/// Frames whose mean stands for all times. The error of so many, h²/24 times the change of the slope from end to end,
/// is far below that of the samples for blocks of pixels.
const FRAMES: u32 = 16;

fn check_frames(scene_name: &str, scene: &Scene, settings: &Settings) {
    let whole = Settings {
        samples: 0..2048,
        ..settings.clone()
    };
    let found = Blocks::of(&render_gpu(scene, &whole), BLOCK);
    let part = Settings {
        samples: 0..128,
        ..settings.clone()
    };
    let frames = mean_of_frames(scene, &part, FRAMES);
    let name = settings.integrator.name();
    let _left = Left::of(format!("frames, {scene_name}, {name}"), &found, &frames);
    let worst = |film: &Blocks| {
        let all = film.deviations(&frames).into_iter();
        all.fold(0.0, |worst: f64, z| worst.max(z.abs()))
    };
    // Companion: half as far.
    let mut slower = scene.clone();
    for sphere in &mut slower.spheres {
        sphere.motion *= 0.5;
    }
    let wrong = worst(&Blocks::of(&render_gpu(&slower, &whole), BLOCK));
    let worst = worst(&found);
    // How many standard errors a change by 5 % would be in the mean.
    let pairs = std::iter::zip(&found.channels, &frames.channels);
    let shown = pairs.map(|(a, b)| 0.05 * b[0] / (a[1] + b[1]).sqrt());
    let power = shown.sum::<f64>() / found.channels.len() as f64;
    let limit = normal_limit(found.channels.len());
    eprintln!(
        "{name}: {worst:.2} of {limit:.2}; 5 % would be {power:.1}; half as far is {wrong:.1}"
    );
    assert!(worst < limit, "{name}: {worst} deviations");
    assert!(wrong > limit, "{name}: the companion is off by {wrong}");
    assert!(power > limit, "{name}: the power is {power}");
}

fn small(scene: &Scene) -> Settings {
    settings(scene, SIZE, SIZE, 64)
}

/// A lamp that moves over balls at rest.
const LAMP: &str = "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0.4, 0]\nfov = 40.0\nshutter = [-1, 1]\n\
    [image]\nwidth = 24\nheight = 24\n[material.floor]\ntype = \"diffuse\"\nalbedo = [0.6, 0.5, 0.4]\n\
    [material.gloss]\ntype = \"conductor\"\npreset = \"gold\"\nroughness = 0.5\n\
    [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [6, 6, 6]\n\
    [[sphere]]\ncenter = [0, -100, 0]\nradius = 100\nmaterial = \"floor\"\n\
    [[sphere]]\ncenter = [0.6, 0.5, 0]\nradius = 0.5\nmaterial = \"gloss\"\n\
    [[sphere]]\ncenter = [-0.6, 0.4, 0.3]\nradius = 0.4\nmaterial = \"floor\"\n\
    [[sphere]]\ncenter = [0, 1.4, 0.6]\nradius = 0.3\nmaterial = \"lamp\"\nvelocity = [1.2, 0.2, -0.6]\n";

#[test]
fn a_moving_lamp_is_the_mean_of_its_frames() {
    let scene = scene(LAMP);
    let base = small(&scene);
    check_frames("lamp", &scene, &base);
    for (integrator, light_sampling) in [
        (Integrator::Nee, LightSampling::Cone),
        (
            Integrator::Lecture { termination: 0.2 },
            LightSampling::Projected,
        ),
    ] {
        if matches!(integrator, Integrator::Nee) && !crate::thorough::thorough() {
            // The short form can show what the others have in common.
            continue;
        }
        let settings = Settings {
            integrator,
            light_sampling: integrator.samples_lights().then_some(light_sampling),
            ..base.clone()
        };
        check_frames("lamp", &scene, &settings);
    }
}

#[test]
fn whatever_moves_is_the_mean_of_its_frames() {
    let scene = moving();
    check_frames("all", &scene, &small(&scene));
}

#[test]
fn all_geometries_have_one_image() {
    let scene = moving();
    let film = |geometry, seed| {
        let settings = Settings {
            geometry,
            seed,
            ..settings(&scene, 32, 32, 16)
        };
        render_gpu(&scene, &settings)
    };
    let [baked, list, tree] = [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ]
    .map(|geometry| film(geometry, 0));
    for (name, other) in [("list", &list), ("bvh", &tree)] {
        let off = share_off(other, &baked);
        eprintln!("{name}: {off}");
        let what = format!("{off} of the values differ");
        assert_alike(&format!("motion, {name}"), other, &baked, off < 0.02, what);
    }
    assert!(share_off(&film(GeometryChoice::List, 1), &baked) > 0.02);
}

/// The device and the reference trace the same paths, and see the same layers at their times.
#[test]
fn images_and_layers_are_those_of_the_reference() {
    let scene = moving();
    let settings = Settings {
        features: true,
        ..settings(&scene, 24, 24, 16)
    };
    let sums = |film: &Film| -> Vec<f64> {
        let pixel = |i| {
            let aovs = film.aovs(i).expect("layers");
            [aovs.normal[0], aovs.normal[1], aovs.depth, aovs.hits]
        };
        (0..film.rect().pixels()).flat_map(pixel).collect()
    };
    let (found, wanted) = (render_gpu(&scene, &settings), render_cpu(&scene, &settings));
    let still = render_cpu(&at(&scene, 0.0), &settings);
    let _left = Left::of("motion, reference", &found, &wanted);
    assert!(share_off(&found, &wanted) < 0.02);
    assert!(share_off(&found, &still) > 0.5);
    let [found, wanted, still] = [found, wanted, still].map(|film| sums(&film));
    let near = |wanted: &[f64]| {
        let near = |(a, b): &(&f64, &f64)| (*a - *b).abs() <= 1.0e-3 * b.abs().max(0.1);
        found.iter().zip(wanted).filter(near).count() as f64 / found.len() as f64
    };
    assert!(near(&wanted) > 0.98, "{}", near(&wanted));
    assert!(near(&still) < 0.9, "{}", near(&still));
}

fn kernel(scene: &Scene, settings: &Settings) -> String {
    let job = job(scene, settings);
    let kernel = link(Stage::Path, job.scene(), job.placement(), job.effects());
    kernel.unwrap_or_else(|e| panic!("{e}")).wgsl
}

const BALL: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 8\nheight = 8\n\
    [material.glass]\ntype = \"dielectric\"\nior = 1.5\n[material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\n\
    emission = [1, 1, 1]\n[[sphere]]\ncenter = [1, 2, 0]\nradius = 0.5\nmaterial = \"lamp\"\n\
    [[sphere]]\ncenter = [0.25, 0, 0]\nradius = 1\nmaterial = \"glass\"\n";

/// The ball with a shutter and a velocity.
fn ball(shutter: &str, velocity: &str) -> String {
    let mut text = BALL.replacen("fov", &format!("{shutter}fov"), 1);
    text += velocity;
    text
}

#[test]
fn what_does_not_move_has_no_motion_in_its_kernel() {
    let plain = scene(BALL);
    for geometry in [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ] {
        let kernel = |scene: &Scene| {
            let settings = Settings {
                geometry,
                ..Settings::for_scene(scene)
            };
            kernel(scene, &settings)
        };
        let wanted = kernel(&plain);
        assert!(!wanted.contains("motion"), "{wanted}");
        for (shutter, velocity) in [
            ("shutter = [0, 1]\n", ""),
            ("shutter = [-2, 3]\n", "velocity = [0, 0, 0]\n"),
            ("shutter = [0, 0]\n", "velocity = [1, 2, 3]\n"),
            ("", "velocity = [1, 2, 3]\n"),
        ] {
            let other = scene(&ball(shutter, velocity));
            assert_eq!(content_hash(&other), content_hash(&plain));
            assert_eq!(other, plain);
            assert!(kernel(&other) == wanted, "{shutter}{velocity}");
        }
        // A still image at another time is one of a ball that is elsewhere.
        let displaced = scene(&BALL.replace("[0.25, 0, 0]", "[1.25, 1.0, -0.5]"));
        let later = scene(&ball(
            "shutter = [2, 2]\n",
            "velocity = [0.5, 0.5, -0.25]\n",
        ));
        assert_eq!(displaced, later);
        assert!(kernel(&displaced) == kernel(&later));
        // Where spheres are is in the text of this one alone.
        let says_where = geometry == GeometryChoice::Baked;
        assert_eq!(kernel(&later) != wanted, says_where);
        // And what moves does so in its kernel.
        let moving = scene(&ball("shutter = [0, 1]\n", "velocity = [0.5, 0, 0]\n"));
        assert_ne!(content_hash(&moving), content_hash(&at(&moving, 0.0)));
        assert!(kernel(&moving).contains("motion"));
    }
}

#[test]
fn ways_that_cannot_be_are_refused_with_their_lines() {
    for (shutter, velocity, place, parts) in [
        (
            "shutter = [1, 0]\n",
            "",
            "4:11",
            ["closes before it opens", "[0.0, 1.0]"],
        ),
        // Through the camera, and into it.
        (
            "shutter = [0, 1]\n",
            "velocity = [0, 0, 9]\n",
            "24:12",
            ["over the camera", "2 │ position"],
        ),
        (
            "shutter = [0, 1]\n",
            "velocity = [0, 0, 3.5]\n",
            "24:12",
            ["over the camera", "outside of it"],
        ),
        // As far as nothing is known of it any more.
        (
            "shutter = [0, 1]\n",
            "velocity = [2e4, 0, 0]\n",
            "24:12",
            ["by 20000 times its radius", "at most 16384"],
        ),
        (
            "shutter = [0, 1e15]\n",
            "velocity = [1e15, 0, 0]\n",
            "24:12",
            ["beyond 1e20", "4 │ shutter"],
        ),
        (
            "shutter = [1e15, 1e15]\n",
            "velocity = [0, 1e15, 0]\n",
            "24:12",
            ["beyond 1e20", "lower velocity"],
        ),
    ] {
        let text = ball(shutter, velocity);
        let said = match load_str("bad.toml", &text) {
            Err(Error::Scene(said)) => said,
            other => panic!("{shutter}{velocity}: {other:?}"),
        };
        assert!(said.contains(&format!("┌─ bad.toml:{place}\n")), "{said}");
        assert!(
            parts.iter().all(|part| said.contains(part)),
            "{parts:?}: {said}"
        );
    }
    // The program says so, and exits with 2.
    let folder = Folder::new();
    folder.write(
        "bad.toml",
        ball("shutter = [0, 1]\n", "velocity = [0, 0, 9]\n"),
    );
    for command in ["bad.toml -o out.png", "scene check bad.toml"] {
        let run = folder.run(command);
        assert_eq!(run.code, Some(2), "{run:?}");
        holds(&run.stderr, &["bad.toml:24:12", "over the camera"]);
    }
    // Made by hand, a scene is refused by the job.
    let mut scene = scene(BALL);
    scene.spheres[1].motion = 2.0 * LONGEST_WAY * DVec3::X;
    let settings = Settings::for_scene(&scene);
    assert!(matches!(
        prepare(&scene, &settings),
        Err(Error::Placement(_))
    ));
    scene.spheres[1].motion = 0.5 * LONGEST_WAY * DVec3::Y;
    assert!(prepare(&scene, &settings).is_ok());
    // What is probably not meant is said.
    let loaded = load_str("warned", &ball("", "velocity = [1, 0, 0]\n")).expect("a scene");
    assert!(
        loaded.warnings[0].contains("no `shutter`"),
        "{:?}",
        loaded.warnings
    );
    let loaded = load_str(
        "quiet",
        &ball("shutter = [0, 0]\n", "velocity = [1, 0, 0]\n"),
    );
    assert_eq!(loaded.expect("a scene").warnings, [""; 0]);
}

#[test]
fn the_program_says_what_moves() {
    let folder = Folder::new();
    folder.write(
        "ball.toml",
        ball("shutter = [0, 2]\n", "velocity = [0.5, 0, 0]\n"),
    );
    let said = folder.ok("scene check ball.toml");
    holds(
        &said,
        &["motion       1 sphere, by up to 1.00 while the shutter is open"],
    );
    let said = folder.ok("effects ball.toml");
    holds(&said, &["motion", "for sphere 2 (glass), which moves"]);
    folder.write("still.toml", BALL);
    assert!(!folder.ok("scene check still.toml").contains("motion"));
}

/// A few spheres of any kind that lie and move in all ways to each other.
fn crowd(random: &mut Random) -> Scene {
    let mut scene = scene(
        "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, -1]\nfov = 40.0\n[image]\nwidth = 8\nheight = 8\n\
         [material.glass]\ntype = \"dielectric\"\nior = 1.5\n[material.neon]\ntype = \"dielectric\"\nior = 1.1\n\
         emission = [1, 0, 0]\n[material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [1, 2, 3]\n\
         [material.matte]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n",
    );
    let whole = random.magnitude(-2.0, 0.5) * random.direction();
    while scene.spheres.len() < 12 {
        let known = scene.spheres.len() as f64 * random.unit();
        let known = scene.spheres.get(known as usize).copied();
        let mut sphere = Sphere {
            center: 3.0 * random.unit() * random.direction(),
            motion: whole,
            radius: random.magnitude(-1.5, 0.3),
            material: (4.0 * random.unit()) as usize,
            priority: None,
        };
        if let Some(known) = known {
            let inner = known.radius * random.range(0.3, 1.1);
            match (5.0 * random.unit()) as u32 {
                0 => {
                    // Within, touching or not quite.
                    let aside = (known.radius - inner).abs() * random.range(0.0, 1.05);
                    sphere.center = known.center + aside * random.direction();
                    (sphere.radius, sphere.motion) = (inner, known.motion);
                }
                1 => {
                    let thinner = known.radius * random.magnitude(-6.0, -3.0);
                    sphere.center = known.center + 0.3 * thinner * random.direction();
                    (sphere.radius, sphere.motion) = (known.radius - thinner, known.motion);
                    sphere.motion += thinner * random.unit() * random.direction();
                }
                2 => {
                    sphere.radius = known.radius * random.magnitude(-3.0, -1.0);
                    sphere.center = known.center + known.radius * random.direction();
                }
                _ => {}
            }
        }
        if random.unit() < 0.3 {
            sphere.motion += sphere.radius * random.magnitude(-3.0, 0.5) * random.direction();
        }
        scene.spheres.push(sphere);
    }
    scene
}

/// What is decided for all of the time holds at each time: sides, what is hidden, what holds what, levels, lamps.
#[test]
fn what_is_decided_holds_at_all_times() {
    let mut random = Random::new("decided for all times");
    // How often there was something to hold: hidden, within, levels, sealed; and how often the middle of the time
    // alone would have said something else.
    let (mut seen, mut otherwise) = ([0; 4], 0);
    for _ in 0..400 {
        let scene = crowd(&mut random);
        if prepare(&scene, &Settings::for_scene(&scene)).is_err() {
            continue;
        }
        let whole = Decided::of(&scene);
        for (seen, now) in seen.iter_mut().zip(whole.counts()) {
            *seen += u32::from(now > 0);
        }
        let middle = Decided::of(&at(&scene, 0.0));
        let mut broken = false;
        for i in 0..=16 {
            let still = at(&scene, f64::from(i) / 16.0 - 0.5);
            whole
                .holds_in(&still)
                .unwrap_or_else(|e| panic!("{e}: {still:#?}"));
            broken |= middle.holds_in(&still).is_err();
        }
        otherwise += u32::from(broken);
    }
    assert!(seen.iter().all(|n| *n > 20), "{seen:?}");
    // Companion.
    assert!(otherwise > 50, "{otherwise}");
}

/// What a placement has decided, by index into the scene's spheres.
struct Decided {
    sides: Vec<Side>,
    hidden: Vec<bool>,
    containers: Vec<Option<usize>>,
    levels: Vec<u32>,
    /// Lamps that light sampling leaves out.
    sealed: Vec<bool>,
    /// The dielectrics that the camera is in.
    camera: Vec<usize>,
}

impl Decided {
    fn of(scene: &Scene) -> Self {
        let placement = Placement::new(scene, scene.width, scene.height);
        let count = scene.spheres.len();
        let lit = |i: usize| scene.materials[scene.spheres[i].material].emission != DVec3::ZERO;
        let mut decided = Self {
            sides: (0..count).map(|i| Side::of(scene, i)).collect(),
            hidden: vec![true; count],
            containers: vec![None; count],
            levels: placement.media.level.clone(),
            sealed: vec![false; count],
            camera: placement.media.camera.iter().map(|m| m.sphere).collect(),
        };
        decided.camera.sort_unstable();
        for (i, sphere) in placement.spheres.iter().enumerate() {
            let source = sphere.source;
            decided.hidden[source] = false;
            decided.containers[source] = sphere.container.map(|c| placement.spheres[c].source);
            decided.sealed[source] = lit(source)
                && sphere.side != Side::Inside
                && placement.lights.of_sphere(i).is_none();
        }
        decided
    }

    fn counts(&self) -> [usize; 4] {
        let count = |all: &[bool]| all.iter().filter(|x| **x).count();
        [
            count(&self.hidden),
            self.containers.iter().flatten().count(),
            self.levels.iter().filter(|level| **level > 0).count(),
            count(&self.sealed),
        ]
    }

    /// What does not hold in a scene at rest, if anything does not.
    fn holds_in(&self, still: &Scene) -> Result<(), String> {
        let now = Self::of(still);
        let glass = |i: usize| still.materials[still.spheres[i].material].kind.transmits();
        let spheres = &still.spheres;
        let distance = |i: usize, j: usize| spheres[i].center.distance(spheres[j].center);
        for i in 0..spheres.len() {
            if self.sides[i] != now.sides[i] {
                return Err(format!("the side of {i} is {:?}", now.sides[i]));
            }
            if self.hidden[i] && !now.hidden[i] {
                return Err(format!("{i} is not hidden"));
            }
            if let Some(outer) = self.containers[i] {
                let gap = spheres[outer].radius - spheres[i].radius - distance(i, outer);
                if gap < -1.0e-12 * spheres[outer].radius {
                    return Err(format!("{i} is not in {outer}"));
                }
            }
            if self.sealed[i] && !now.sealed[i] && !now.hidden[i] {
                return Err(format!("{i} can be seen"));
            }
            for j in 0..i {
                let share = distance(i, j) < spheres[i].radius + spheres[j].radius;
                let both = glass(i) && glass(j) && !self.hidden[i] && !self.hidden[j];
                if both && share && self.levels[i] == self.levels[j] {
                    return Err(format!("{i} and {j} are of one level"));
                }
            }
        }
        if self.camera != now.camera {
            return Err(format!("the camera is in {:?}", now.camera));
        }
        Ok(())
    }
}
