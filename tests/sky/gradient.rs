//! The environment `gradient`.

use glam::DVec3;
use gpu_trace::effects::{Effect, Effects};
use gpu_trace::placement::Placement;
use gpu_trace::reference::light::environment::gradient_radiance;
use gpu_trace::scene::{Environment, Gradient, Scene};
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::verify::{Agreement, ULP, vector};

use super::{directions, shows_the_integral};
use crate::common::{probe_of, scene};

const GRADIENT: Gradient = Gradient {
    zenith: DVec3::new(0.25, 0.5, 2.0),
    horizon: DVec3::new(1.0, 0.75, 0.5),
    ground: DVec3::new(0.125, 0.25, 0.0625),
};

const TEXT: &str = "[environment.gradient]\nzenith = [0.25, 0.5, 2.0]\nhorizon = [1.0, 0.75, 0.5]\n\
                    ground = [0.125, 0.25, 0.0625]";

fn in_gradient(more: &str) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 16\n\
         height = 16\n{TEXT}\n{more}"
    ))
}

#[test]
fn gradients_agree() {
    let scene = in_gradient("");
    assert_eq!(scene.environment, Some(Environment::Gradient(GRADIENT)));
    let unit = Placement::new(&scene, 16, 16).radiance_scale;
    let inputs = directions(100_000, "gradients");
    let outputs: Vec<[f32; 4]> = probe_of(&scene, &["gradient"])
        .call("gradient_radiance", &inputs)
        .expect("the probe runs");
    // mix: the difference, two products and a sum, of the larger of two; what is added is not negative.
    let holds = |gradient: &Gradient| {
        let mut agreement = Agreement::default();
        for (w, found) in inputs.iter().zip(&outputs) {
            let truth = gradient_radiance(gradient, vector(*w));
            let off = (vector(*found) / unit - truth).abs().max_element();
            agreement.add(off, 4.0 * ULP * 2.0, || {
                format!("{w:?}: {found:?} for {truth}")
            });
        }
        agreement
    };
    holds(&GRADIENT).assert_holds(100_000);
    // Companions: another colour in one of the three places; and what is above is not below.
    let mut other = GRADIENT;
    other.zenith.x *= 1.0 + 1.0e-5;
    assert!(holds(&other).any_fails());
    let upside_down = Gradient {
        ground: GRADIENT.zenith,
        ..GRADIENT
    };
    assert!(holds(&upside_down).any_fails());
    // No value is negative.
    assert!(outputs.iter().all(|found| found.iter().all(|x| *x >= 0.0)));
}

#[test]
fn a_ball_shows_the_integral() {
    let red = |w: DVec3| gradient_radiance(&GRADIENT, w).x;
    // By hand, straight up: 2 times the integral of (h + (z - h) y) y dy.
    let up = super::mean_over_cosine(DVec3::Y, 1024, red);
    assert!((up - (1.0 / 3.0 + 2.0 / 3.0 * 0.25)).abs() < 1.0e-5, "{up}");
    let integrators = [Integrator::Path, Integrator::Nee, Integrator::Bsdf];
    shows_the_integral(TEXT, red, &integrators, 256, 0.01);
}

#[test]
fn what_sees_no_sky_has_none() {
    let has = |scene: &Scene| {
        let settings = Settings::for_scene(scene);
        let placement = Placement::new(scene, 16, 16);
        Effects::derive(scene, &placement, &settings).has(Effect::Gradient)
    };
    let room = "[material.wall]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n[[sphere]]\n\
                center = [0, 0, 0]\nradius = 10.0\nmaterial = \"wall\"\n";
    assert!(has(&in_gradient("")));
    assert!(!has(&in_gradient(room)), "an opaque sphere is all around");
    let mut black = in_gradient("");
    black.environment = Some(Environment::Gradient(Gradient {
        zenith: DVec3::ZERO,
        horizon: DVec3::ZERO,
        ground: DVec3::ZERO,
    }));
    assert!(!has(&black));
}
