//! Light that glass absorbs: Beer's law alone, and images that are known.

use glam::DVec3;
use gpu_trace::film::Film;
use gpu_trace::job::prepare;
use gpu_trace::materials::fresnel::fresnel;
use gpu_trace::reference::scene::absorption::transmittance;
use gpu_trace::scene::Scene;
use gpu_trace::settings::Settings;
use gpu_trace::statistics::normal_limit;
use gpu_trace::verify::{Agreement, Random, Row, ULP, image_bits, means, settings, vector};

use crate::common::images::{Left, assert_same, uniform};
use crate::common::{probe, render_cpu, render_gpu, scene};

const NO_HIT: f32 = 3.0e38;
const CASES: usize = 100_000;

#[test]
fn transmittance_is_beers() {
    let mut random = Random::new("beer");
    let inputs: Vec<Row> = (0..CASES)
        .map(|i| {
            let t = match i % 4 {
                0 => random.magnitude(-37.5, 38.0),
                _ => random.magnitude(-3.0, 3.0),
            };
            let mut absorption = || match i % 5 {
                0 => 0.0,
                1 => random.magnitude(-37.0, 38.0),
                _ => random.magnitude(-3.0, 1.5) / t,
            };
            // What the host writes: 0, or a normal number. Of others a device may make 0.
            let rounded = |x: f64| match x {
                0.0 => 0.0,
                x => (x.min(1.0e38) as f32).max(f32::MIN_POSITIVE),
            };
            let absorption = [(); 3].map(|()| rounded(absorption()));
            [absorption[0], absorption[1], absorption[2], t as f32]
        })
        .collect();
    let probe = probe(&["dielectric", "interior", "absorption"]);
    let outputs: Vec<Row> = probe
        .call("transmittance", &inputs)
        .expect("the probe runs");
    let run = |factor: f64| {
        let mut agreement = Agreement::default();
        for (input, output) in inputs.iter().zip(&outputs) {
            let (absorption, t) = (vector(*input), f64::from(input[3]));
            let twin = transmittance(factor * absorption, Some(t));
            for c in 0..3 {
                let depth = absorption[c] * t;
                // WGSL allows 3 + 2 x ulp for exp(x), and its argument has 4 roundings; below the normal numbers 0
                // is as good.
                let bound = (3.0 + 6.0 * depth) * ULP * twin[c] + 1.0e-37;
                let place = || format!("{input:?}: {output:?} for {twin}");
                agreement.add((f64::from(output[c]) - twin[c]).abs(), bound, place);
            }
        }
        agreement
    };
    run(1.0).assert_holds(3 * CASES);
    assert!(run(1.001).any_fails(), "companion: 0.1 % is not found");

    // What does not absorb leaves all, of an infinitely long way too; what does leaves nothing of that, however little.
    let least = f32::MIN_POSITIVE;
    let ends: Vec<Row> = vec![
        [0.0, least, 1.0, NO_HIT],
        [0.0, 1.0, 1.0e38, 0.0],
        [0.0, least, 3.0e38, 1.0],
    ];
    let outputs: Vec<Row> = probe.call("transmittance", &ends).expect("the probe runs");
    let wanted = [[1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [1.0, 1.0, 0.0]];
    for ((input, output), wanted) in ends.iter().zip(&outputs).zip(wanted) {
        for c in 0..3 {
            // To the 3 ulp of an exponential; what is not absorbed, exactly.
            let exact = input[c] == 0.0 || wanted[c] == 0.0;
            let off = (f64::from(output[c]) - wanted[c]).abs();
            assert!(
                off <= if exact { 0.0 } else { 3.0 * ULP },
                "{input:?}: {output:?}"
            );
        }
    }
    let far = transmittance(DVec3::new(0.0, 1.0e-300, 1.0), None);
    assert_eq!(far, DVec3::X);
}

/// A camera that looks at `spheres` from so far, under an angle `fov` in degrees, in an environment of 1.
fn seen(distance: f64, fov: f64, spheres: &str) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, 0, {distance:e}]\nlook_at = [0, 0, -1e-9]\nfov = {fov}\n[image]\nwidth = 16\n\
         height = 16\n[environment]\nradiance = [1, 1, 1]\n{spheres}"
    ))
}

fn material(name: &str, ior: f64, absorption: [f64; 3]) -> String {
    format!("[material.{name}]\ntype = \"dielectric\"\nior = {ior}\nabsorption = {absorption:?}\n")
}

fn ball(material: &str, radius: f64, priority: i32) -> String {
    format!(
        "[[sphere]]\ncenter = [0, 0, 0]\nradius = {radius:e}\nmaterial = \"{material}\"\npriority = {priority}\n"
    )
}

/// What an environment of 1 sends through glass, of which a surface reflects `r`, if `x` is left on each way through:
/// r + (1 - r)^2 x (1 + r x + ...). The indices' squares of both crossings cancel.
fn through(r: f64, x: f64) -> f64 {
    r + (1.0 - r).powi(2) * x / (1.0 - r * x)
}

/// The standardised difference of an image's mean from `expected`, by channel.
fn deviations(film: &Film, expected: [f64; 3]) -> [f64; 3] {
    assert_eq!(film.tally().non_finite, 0);
    let pixels = film.rect().pixels();
    std::array::from_fn(|c| {
        let sum: f64 = (0..pixels).map(|i| film.mean(i)[c]).sum();
        let variance = |i| film.variance_of_mean(i).expect("16 batches")[c];
        let error = (0..pixels).map(variance).sum::<f64>().sqrt();
        (sum - pixels as f64 * expected[c]) / error
    })
}

const TINT: [f64; 3] = [0.1, 0.5, 1.5];

#[test]
fn a_ball_seen_through_its_centre_absorbs_along_its_diameter() {
    // Rays within 1e-5 of the axis: a way through the ball is shorter by 1e-10 at most. The way is that through the
    // tinted glass alone, which of two balls in each other is the one with the higher priority; of the same index, so
    // that their surface is none.
    let tinted = material("tinted", 1.5, TINT) + &ball("tinted", 1.0, 0);
    let clear = |priority| {
        tinted.clone() + &material("clear", 1.5, [0.0; 3]) + &ball("clear", 0.5, priority)
    };
    let r = fresnel(1.0, 1.5).reflected;
    let limit = normal_limit(9);
    for (name, spheres, way) in [
        ("one", tinted.clone(), 2.0),
        ("a clear core", clear(1), 1.0),
        ("a hidden core", clear(-1), 2.0),
    ] {
        let scene = seen(4.0, 1.0e-4, &spheres);
        let film = render_gpu(&scene, &settings(&scene, 16, 16, 2048));
        let expected = |factor: f64| TINT.map(|a| through(r, (-factor * a * way).exp()));
        let wanted = uniform(&film, expected(1.0));
        let _left = Left::of(format!("a tinted ball, {name}"), &film, &wanted);
        let z = deviations(&film, expected(1.0));
        eprintln!("{name}: z = {z:?}");
        assert!(z.iter().all(|z| z.abs() < limit), "{name}: {z:?}");
        // Power: 2 % more or less of the way is found.
        let wrong = deviations(&film, expected(1.02));
        assert!(
            wrong[1].abs() > limit && wrong[2].abs() > limit,
            "{name}: {wrong:?}"
        );
    }
}

#[test]
fn a_tinted_ball_in_a_furnace_is_what_quadrature_says() {
    let spheres = material("tinted", 1.5, TINT) + &ball("tinted", 1.0, 0);
    let scene = seen(4.0, 40.0, &spheres);
    let film = render_gpu(&scene, &settings(&scene, 16, 16, 4096));
    let _left = Left::alone("a tinted ball", &film);
    assert_eq!(film.tally().non_finite, 0);
    // By the impact parameter b of a ray: a way through the ball has the length 2 cos t, at every reflection.
    let radiance = |b: f64, absorption: f64| {
        if b >= 1.0 {
            return 1.0;
        }
        let f = fresnel((1.0 - b * b).sqrt(), 1.5);
        through(f.reflected, (-2.0 * absorption * f.cos_t).exp())
    };
    let edge = f64::to_radians(20.0).tan();
    let pixel = |x: usize, y: usize, absorption: f64| -> Option<f64> {
        const POINTS: usize = 32;
        let place =
            |i: usize, j: usize| edge * ((i as f64 + (j as f64 + 0.5) / POINTS as f64) / 8.0 - 1.0);
        let mut sum = 0.0;
        let mut least = f64::INFINITY;
        let mut most = 0.0f64;
        for j in 0..POINTS {
            for k in 0..POINTS {
                let across = place(x, j).hypot(place(y, k));
                let b = 4.0 * across / across.hypot(1.0);
                (least, most) = (least.min(b), most.max(b));
                sum += radiance(b, absorption);
            }
        }
        // The rule is no good near the limb.
        let smooth = most < 0.97 || least > 1.0;
        smooth.then(|| sum / (POINTS * POINTS) as f64)
    };
    let z = |factor: f64| -> Vec<f64> {
        let mut all = Vec::new();
        for i in 0..256 {
            let variance = film.variance_of_mean(i).expect("16 batches");
            for c in 0..3 {
                let Some(expected) = pixel(i % 16, i / 16, factor * TINT[c]) else {
                    continue;
                };
                // 16 roundings of f32 for pixels without a variance.
                let floor = 16.0 * f64::from(f32::EPSILON);
                all.push((film.mean(i)[c] - expected) / (variance[c].sqrt() + floor));
            }
        }
        all
    };
    let worst = |z: &[f64]| z.iter().fold(0.0, |worst: f64, z| worst.max(z.abs()));
    let found = z(1.0);
    assert!(found.len() > 300, "{}", found.len());
    let pooled = found.iter().sum::<f64>() / (found.len() as f64).sqrt();
    // Batches of 16 and more: Student's t of some 60 degrees of freedom, for which the normal's limit is a fifth larger.
    let limit = 1.2 * normal_limit(found.len());
    eprintln!(
        "worst {:.2} of {limit:.2}, pooled {pooled:.2}",
        worst(&found)
    );
    assert!(worst(&found) < limit && pooled.abs() < 3.9, "{pooled}");
    let wrong = z(1.05);
    let pooled = wrong.iter().sum::<f64>() / (wrong.len() as f64).sqrt();
    assert!(pooled.abs() > 3.9, "companion: 5 % is not found: {pooled}");
}

#[test]
fn units_do_not_matter() {
    // Lengths times a power of two, absorption over it: the same numbers in the kernel's unit.
    let image = |exponent: i32, tint: f64| {
        let unit = 2f64.powi(exponent);
        let absorption = TINT.map(|a| tint * a / unit);
        let text = material("tinted", 1.5, absorption) + &ball("tinted", unit, 0);
        let scene = seen(4.0 * unit, 36.0, &text);
        render_gpu(&scene, &settings(&scene, 16, 16, 16))
    };
    let whole = image(0, 1.0);
    for exponent in [-60, -20, 20, 60] {
        assert_same(format!("2^{exponent}"), &image(exponent, 1.0), &whole);
    }
    let other = image(20, 1.001);
    assert_ne!(image_bits(&other), image_bits(&whole), "companion");
}

#[test]
fn a_room_in_tinted_glass_is_full_of_it() {
    // The room's wall is opaque, and what lies around it no more than what fills it: every ray of the camera in its
    // middle has the length 1.
    let room = |absorption: [f64; 3]| {
        scene(&format!(
            "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov = 90.0\n[image]\nwidth = 8\nheight = 8\n\
             {}[material.wall]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [1, 1, 1]\n{}\
             [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"wall\"\n",
            material("tinted", 1.5, absorption),
            ball("tinted", 2.0, 0)
        ))
    };
    let expected = |factor: f64| TINT.map(|a| (-factor * a).exp());
    let off = |film: &Film, factor: f64| {
        let (values, expected) = (means(film), expected(factor));
        let off = values.iter().zip(expected.iter().cycle());
        off.map(|(x, y)| (x / y - 1.0).abs()).fold(0.0, f64::max)
    };
    let tinted = room(TINT);
    let settings = settings(&tinted, 8, 8, 16);
    // The length has some 8 roundings, the exponential 3 + 2 x, the sum 2.
    let (film, cpu) = (
        render_gpu(&tinted, &settings),
        render_cpu(&tinted, &settings),
    );
    let wanted = uniform(&film, expected(1.0));
    let _left = [("GPU", &film), ("CPU", &cpu)]
        .map(|(name, film)| Left::of(format!("a tinted room, {name}"), film, &wanted));
    assert!(off(&film, 1.0) < 25.0 * ULP, "{:e}", off(&film, 1.0));
    assert!(off(&film, 1.0001) > 25.0 * ULP, "companion");
    assert!(off(&cpu, 1.0) < 1.0e-6);
    // As dark as can be: no number overflows.
    let film = render_gpu(&room([0.0, 1.0e20, 1.0e20]), &settings);
    let _dark = Left::alone("a dark room", &film);
    assert_eq!(film.tally().non_finite, 0);
    assert_eq!(film.mean(0), [1.0, 0.0, 0.0]);
}

#[test]
fn what_the_device_cannot_hold_is_refused() {
    // Per unit of the whole scene, which is 2^63 here.
    let text = material("tinted", 1.5, [0.0, 1.0e20, 0.0]) + &ball("tinted", 1.0e19, 0);
    let scene = seen(4.0e19, 36.0, &text);
    let refused = prepare(&scene, &Settings::for_scene(&scene));
    let text = refused.expect_err("refused").to_string();
    assert!(
        text.contains("the absorption in sphere 1 in units of the whole scene"),
        "{text}"
    );
}
