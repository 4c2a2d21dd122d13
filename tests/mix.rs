//! Mixes: what the weights make of two materials, whatever draws the directions, and what is refused.
//!
//! That device and twin agree, that what is drawn follows the pdf, and that weights are values over pdfs, the tests of
//! all materials have (`materials`, `distribution`).

use glam::DVec3;
use gpu_trace::error::Error;
use gpu_trace::film::Film;
use gpu_trace::materials::mirror::Mirror;
use gpu_trace::materials::mix::{Mix, Part};
use gpu_trace::materials::{Bsdf, Event, Material, MaterialKind, Surface, luminance};
use gpu_trace::placement::Placement;
use gpu_trace::reference::scene::texture::{TexturePoint, kind_at};
use gpu_trace::scene::Scene;
use gpu_trace::scene::load::load_str;
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::statistics::{mean_and_error, normal_limit};
use gpu_trace::verify::{Random, settings};

use crate::common::images::{Left, assert_alike, largest_difference};
use crate::common::{job, render_cpu, render_gpu, scene};

/// Materials that mixes are of, from line 1 on.
const PARTS: &str = r#"
[material.red]
type = "diffuse"
albedo = [0.75, 0.25, 0.125]
[material.blue]
type = "diffuse"
albedo = [0.25, 0.125, 0.875]
[material.mirror]
type = "mirror"
reflectance = [0.75, 0.5, 0.875]
[material.silver]
type = "conductor"
preset = "silver"
[material.gold]
type = "conductor"
preset = "gold"
roughness = 0.3
anisotropy = 0.8
axis = [1.0, 0.0, 0.5]
[material.cloth]
type = "sheen"
color = [0.5, 0.25, 0.75]
roughness = 0.5
[material.coated]
type = "car-paint"
preset = "polaris-silber"
clearcoat = { ior = 1.5 }
[material.glass]
type = "dielectric"
ior = 1.5
[material.lit]
type = "diffuse"
albedo = [0.5, 0.5, 0.5]
emission = [3.0, 2.0, 1.0]
"#;

/// A ball of the material `ball`, which is given by its lines, under a lamp and light from all around.
fn text(ball: &str) -> String {
    format!(
        "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 30\n[image]\nwidth = 24\nheight = 24\n\
         [environment]\nradiance = [0.5, 0.4, 0.3]\n[material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\n\
         emission = [40, 50, 60]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"ball\"\n\
         [[sphere]]\ncenter = [2, 3, 3]\nradius = 0.5\nmaterial = \"lamp\"\n{PARTS}[material.ball]\n{ball}\n"
    )
}

fn mix_of(a: &str, b: &str, weight: &str) -> String {
    format!("type = \"mix\"\nmaterials = [\"{a}\", \"{b}\"]\nweight = {weight}")
}

fn ball(lines: &str) -> Scene {
    scene(&text(lines))
}

fn image(scene: &Scene) -> Film {
    render_gpu(scene, &settings(scene, 24, 24, 16))
}

#[test]
fn colours_are_mixed() {
    // Both draw the same directions: all that differs is rounding.
    let diffuse = |albedo: &str| format!("type = \"diffuse\"\nalbedo = {albedo}");
    let plain = diffuse("[0.625, 0.21875, 0.3125]");
    let checker = diffuse("{ checker = [[0.75, 0.25, 0.125], [0.25, 0.125, 0.875]], size = 0.3 }");
    let noise =
        diffuse("{ noise = [[0.75, 0.25, 0.125], [0.25, 0.125, 0.875]], size = 0.4, octaves = 3 }");
    for (weight, colour) in [
        ("0.25", &plain),
        ("{ checker = [0, 1], size = 0.3 }", &checker),
        ("{ noise = [0, 1], size = 0.4, octaves = 3 }", &noise),
    ] {
        let mixed = image(&ball(&mix_of("red", "blue", weight)));
        let wanted = image(&ball(colour));
        let found = largest_difference(&mixed, &wanted);
        eprintln!("{weight}: {found:e}");
        assert_alike(weight, &mixed, &wanted, found < 1.0e-5, found);
        // Companion: the other way round.
        let other = image(&ball(&mix_of("blue", "red", weight)));
        assert!(largest_difference(&other, &wanted) > 1.0e-2, "{weight}");
    }
}

#[test]
fn weights_of_0_and_1_are_the_parts() {
    for name in ["mirror", "gold", "cloth", "coated"] {
        let alone = image(&part(name));
        for (a, b, weight) in [(name, "red", "0.0"), ("red", name, "1.0")] {
            let mixed = image(&ball(&mix_of(a, b, weight)));
            let found = largest_difference(&mixed, &alone);
            eprintln!("{name} {weight}: {found:e}");
            let name = format!("{name} {weight}");
            assert_alike(&name, &mixed, &alone, found < 1.0e-4, found);
        }
        // Companion.
        let other = image(&ball(&mix_of("red", name, "0.9375")));
        assert!(largest_difference(&other, &alone) > 1.0e-3, "{name}");
    }
}

/// The ball of one of the parts.
fn part(name: &str) -> Scene {
    let mut scene = ball("type = \"diffuse\"\nalbedo = [0, 0, 0]");
    let of = |name: &str| scene.materials.iter().position(|m| m.name == name);
    let (own, part) = (of("ball").expect("a ball"), of(name).expect("a part"));
    scene.materials[own].kind = scene.materials[part].kind.clone();
    scene
}

/// Mean and error of an image's light.
fn light(scene: &Scene, integrator: Integrator) -> (f64, f64) {
    let settings = Settings {
        integrator,
        max_bounces: 1,
        ..settings(scene, 24, 24, 256)
    };
    let film = render_gpu(scene, &settings);
    let pixels = film.rect().pixels();
    let variance: f64 = (0..pixels)
        .map(|i| luminance(film.variance_of_mean(i).expect("batches").into()))
        .sum();
    let sum: f64 = (0..pixels).map(|i| luminance(film.mean(i).into())).sum();
    // Channels of a path are alike: of their weighed sum the error is at most that of one.
    (sum / pixels as f64, variance.sqrt() / pixels as f64)
}

#[test]
fn light_is_mixed_whatever_draws_it() {
    // Over one event the image is linear in f: a ball of a mix sends what those of its parts send, by weight. Smooth
    // parts among them, which light sampling cannot find and the others' pdf has nothing of.
    let limit = normal_limit(24);
    for (a, b) in [("mirror", "red"), ("gold", "cloth"), ("coated", "silver")] {
        let wanted = |weight: f64| {
            let [(x, dx), (y, dy)] = [a, b].map(|name| light(&part(name), Integrator::Path));
            let error = ((1.0 - weight) * dx).hypot(weight * dy);
            ((1.0 - weight) * x + weight * y, error)
        };
        let (right, wrong) = (wanted(0.375), wanted(0.75));
        for integrator in [
            Integrator::Path,
            Integrator::Bsdf,
            Integrator::Nee,
            Integrator::Lecture { termination: 0.2 },
        ] {
            let (mean, error) = light(&ball(&mix_of(a, b, "0.375")), integrator);
            let z = |(wanted, own): (f64, f64)| (mean - wanted).abs() / error.hypot(own);
            eprintln!(
                "{a}, {b}, {integrator:?}: {mean} +- {error}, {right:?}, z {}",
                z(right)
            );
            assert!(z(right) < limit, "{a}, {b}, {integrator:?}");
            // Companion, where so few samples tell anything.
            assert!(
                integrator != Integrator::Path || z(wrong) > limit,
                "{a}, {b}"
            );
        }
    }
}

#[test]
fn two_mirrors_are_one_of_both() {
    let mirror = |reflectance: [f64; 3]| {
        Material::new(
            "mirror",
            Mirror {
                reflectance: reflectance.into(),
            }
            .into(),
        )
    };
    let part = |material, second| Part {
        material,
        second,
        inner: Vec::new(),
    };
    let mix = Mix {
        materials: ["a", "b"].map(str::to_owned),
        weight: 0.25,
        parts: vec![
            part(mirror([1.0, 0.5, 0.0]), false),
            part(mirror([0.2, 0.4, 0.6]), true),
        ],
    };
    let surface = Surface {
        normal: DVec3::Z,
        eta: 1.0,
        offset: DVec3::ZERO,
    };
    assert_eq!(mix.delta_share(&surface, DVec3::Z), 1.0);
    let mut random = Random::new("mirrors");
    let reds: Vec<f64> = (0..10_000)
        .map(|_| {
            let s = mix.sample(&surface, DVec3::Z, random.unit4().map(f64::from));
            assert!(s.event.is(Event::DELTA) && s.pdf == 0.0);
            s.weight.x
        })
        .collect();
    let (mean, error) = mean_and_error(&reds);
    let wanted = 0.75 * 1.0 + 0.25 * 0.2;
    assert!((mean - wanted).abs() < 4.0 * error, "{mean} for {wanted}");
    assert!((mean - 0.6).abs() > 4.0 * error, "companion");
}

#[test]
fn mixes_of_mixes_are_flat() {
    let inner = "[material.inner]\ntype = \"mix\"\nmaterials = [\"blue\", \"cloth\"]\nweight = { checker = [0.5, 0.125], size = 10.0 }\n";
    let scene = scene(&format!("{}{inner}", text(&mix_of("red", "inner", "0.25"))));
    let own = scene
        .materials
        .iter()
        .find(|m| m.name == "ball")
        .expect("a ball");
    assert_eq!(own.kind.parts().len(), 3);
    // In the first cell.
    let point = TexturePoint {
        offset: DVec3::splat(0.5),
        normal: DVec3::Z,
    };
    let kind = kind_at(own, &point);
    let MaterialKind::Mix(mix) = &*kind else {
        panic!("it is none");
    };
    assert_eq!(mix.weights(), [0.75, 0.125, 0.125]);
    let surface = Surface {
        normal: DVec3::Z,
        eta: 1.0,
        offset: point.offset,
    };
    let [wo, wi] = [DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, -0.6, 0.8)];
    let of = |name: &str| {
        let part = scene.materials.iter().find(|m| m.name == name);
        part.expect("a part").kind.evaluate(&surface, wo, wi).f_cos
    };
    let wanted = 0.75 * of("red") + 0.125 * of("blue") + 0.125 * of("cloth");
    assert!(
        (mix.evaluate(&surface, wo, wi).f_cos - wanted)
            .abs()
            .max_element()
            < 1.0e-15
    );
    // What is used by mixes is used; what can be is no more than all.
    let most = DVec3::new(0.8, 0.3, 0.9);
    assert!(own.albedo().cmple(most).all());
    let film = image(&scene);
    let cpu = render_cpu(&scene, &settings(&scene, 24, 24, 16));
    let found = largest_difference(&film, &cpu);
    assert_alike("mixes of mixes", &film, &cpu, found < 1.0e-2, found);
}

#[test]
fn only_the_mix_emits() {
    let dark = text(&mix_of("lit", "red", "0.5"))
        .replace("emission = [40, 50, 60]", "")
        .replace("radiance = [0.5, 0.4, 0.3]", "radiance = [0, 0, 0]");
    let film = |text: &str| {
        let scene = scene(text);
        image(&scene)
    };
    let lit = format!("{dark}emission = [2, 1, 4]\n");
    for (name, text, wanted) in [("dark", &dark, [0.0; 3]), ("lit", &lit, [2.0, 1.0, 4.0])] {
        let film = film(text);
        let _left = Left::alone(format!("a {name} mix"), &film);
        assert_eq!(film.mean(12 * 24 + 12), wanted);
    }
    // And its colour is the mean of theirs.
    let scene = ball(&mix_of("red", "blue", "0.25"));
    let own = scene
        .materials
        .iter()
        .find(|m| m.name == "ball")
        .expect("a ball");
    assert_eq!(own.kind.color(), DVec3::new(0.625, 0.21875, 0.3125));
}

#[test]
fn the_kernel_has_what_the_parts_ask_for() {
    let names = |lines: &str| {
        let scene = ball(lines);
        let job = job(&scene, &Settings::for_scene(&scene));
        let names: Vec<&str> = job.effects().names().collect();
        names.join(" ")
    };
    let mixed = names(&mix_of("coated", "cloth", "{ noise = [0, 1] }"));
    for name in [
        "mix",
        "car_paint_coated",
        "sheen",
        "texture_noise",
        "textured_weight",
    ] {
        assert!(
            mixed.split(' ').any(|own| own == name),
            "{name} is not in {mixed}"
        );
    }
    assert!(
        !mixed.contains("conductor") && !mixed.contains("mirror"),
        "{mixed}"
    );
    let scene = ball(&mix_of("red", "blue", "0.5"));
    assert_eq!(Placement::new(&scene, 24, 24).mixed, [2, 0]);
}

#[test]
fn what_is_no_mix_is_refused() {
    let line = |text: &str, of: &str| 1 + text[..text.find(of).expect(of)].matches('\n').count();
    let refused = |more: &str, place: &str, says: &[&str]| {
        let text = text(more);
        let Err(Error::Scene(message)) = load_str("scene", &text) else {
            panic!("{more}: it is accepted");
        };
        let place = format!("scene:{}:", line(&text, place));
        for part in says.iter().chain([&place.as_str()]) {
            assert!(message.contains(part), "{part:?} is not in {message}");
        }
    };
    let names = "materials = [\"red\"";
    refused(
        &mix_of("red", "glass", "0.5"),
        names,
        &["\"glass\" is a dielectric, and no part of a mix"],
    );
    refused(
        &mix_of("red", "blu", "0.5"),
        names,
        &["unknown material \"blu\"", "did you mean \"blue\"?"],
    );
    refused(
        &mix_of("red", "ball", "0.5"),
        names,
        &["\"ball\" is a mix of itself"],
    );
    refused(
        &format!(
            "{}\n[material.other]\n{}",
            mix_of("red", "other", "0.5"),
            mix_of("blue", "ball", "0.5")
        ),
        names,
        &["is a mix of itself: \"ball\", of \"other\", of \"ball\""],
    );
    refused(
        "type = \"mix\"\nmaterials = [\"red\"]\nweight = 0.5",
        names,
        &["`materials` must have exactly 2 names"],
    );
    refused(
        "type = \"mix\"\nmaterials = \"red\"\nweight = 0.5",
        "materials = \"red\"",
        &["`materials` must be an array of 2 names"],
    );
    refused(
        "type = \"mix\"\nmaterials = [\"red\", 3]\nweight = 0.5",
        names,
        &["must be a string"],
    );
    refused(
        &mix_of("red", "blue", "1.5"),
        "weight = 1.5",
        &["`weight`", "[0, 1]"],
    );
    refused(
        &mix_of("red", "blue", "{ checker = [0, 2] }"),
        "weight = {",
        &["`checker` must be in [0, 1]"],
    );
    refused(
        "type = \"mix\"\nmaterials = [\"red\", \"blue\"]",
        "[material.ball]",
        &["`weight` is missing"],
    );
    // A chain of mixes, of more materials than one may be of.
    let chain = |links: usize| {
        let link = |i: usize| {
            format!(
                "[material.m{i}]\n{}\n",
                mix_of("red", &format!("m{}", i + 1), "0.5")
            )
        };
        let links: String = (0..links).map(link).collect();
        format!(
            "{}\n{links}[material.m{}]\ntype = \"diffuse\"\nalbedo = [1, 1, 1]\n",
            mix_of("red", "m0", "0.5"),
            links.matches("[material.").count()
        )
    };
    load_str("scene", &text(&chain(62))).unwrap_or_else(|e| panic!("{e}"));
    for links in [63, 1000] {
        let error = load_str("scene", &text(&chain(links)))
            .expect_err("too many")
            .to_string();
        assert!(error.contains("is of more than 64 materials"), "{error}");
    }
}

#[test]
fn the_hash_is_of_the_parts() {
    let hash = |lines: &str, names: &dyn Fn(String) -> String| {
        let text = names(text(lines));
        load_str("scene", &text)
            .unwrap_or_else(|e| panic!("{e}"))
            .hash
    };
    let same = |text: String| text;
    let plain = hash(&mix_of("red", "blue", "0.25"), &same);
    let renamed = |text: String| {
        text.replace("\"red\"", "\"rosy\"")
            .replace("material.red", "material.rosy")
    };
    assert_eq!(plain, hash(&mix_of("red", "blue", "0.25"), &renamed));
    let recoloured = |text: String| text.replace("albedo = [0.75,", "albedo = [0.7,");
    let others = [
        hash(&mix_of("red", "blue", "0.25"), &recoloured),
        hash(&mix_of("red", "cloth", "0.25"), &same),
        hash(&mix_of("blue", "red", "0.25"), &same),
        hash(&mix_of("red", "blue", "0.5"), &same),
        hash(&mix_of("red", "blue", "{ noise = [0, 1] }"), &same),
    ];
    assert!(others.iter().all(|other| *other != plain));
}
