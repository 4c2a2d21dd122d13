//! Seven balls of each material, against seven diffuse ones.

use gpu_trace::materials::{ALL, forms};
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::load::load_str;
use gpu_trace::settings::{Integrator, Settings};

use super::{compare, ours};

/// Prints the table: of each form of each material its first test case.
pub(crate) fn run() {
    let balls = load_str("balls", include_str!("balls.toml")).unwrap_or_else(|e| panic!("{e}"));
    let as_it_comes = |s: &mut Settings| {
        s.integrator = Integrator::Path;
        s.sampler = Sampler::Sobol;
    };
    let contestants = forms().iter().map(|form| {
        let mut cases = ALL.iter().flat_map(|material| (material.cases)());
        let kind = cases.find(|kind| kind.form() == *form);
        let mut scene = balls.scene.clone();
        let ball = scene.materials.iter_mut().find(|m| m.name == "ball");
        if let Some((ball, kind)) = ball.zip(kind) {
            ball.kind = kind;
        }
        (form.name, ours(&scene, as_it_comes, &[]))
    });
    compare(
        "seven balls of a material on a diffuse floor, 192x128",
        &mut contestants.collect::<Vec<_>>(),
    );
}
