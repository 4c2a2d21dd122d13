//! What the loop over vertices carries from one turn to the next: no more than the effects in use need.

use gpu_trace::effects::{Effect, Effects};
use gpu_trace::job::Job;
use gpu_trace::prices::forced;
use gpu_trace::shader::{Stage, link};

use crate::common::{job, scene_file};
use gpu_trace::settings::Settings;

fn state(job: &Job, effects: &Effects) -> u32 {
    let kernel = link(Stage::Path, job.scene(), job.placement(), effects);
    let kernel = kernel.unwrap_or_else(|e| panic!("{e}"));
    kernel.state_bytes("render")
}

/// In the table's order.
const STATEFUL: [&str; 11] = [
    "straddle",
    "nested",
    "classes",
    "features",
    "dielectric",
    "rough_dielectric",
    "priority",
    "absorption",
    "dispersion",
    "lamp_images",
    "radiance_cache",
];

/// Whatever lets paths into spheres needs to know what they are in; some have members of a path or of a pixel's sums.
/// All others, materials, textures, lights, environments among them, leave nothing behind.
#[test]
fn few_effects_add_to_what_the_loop_carries() {
    let scene = scene_file("scenes/lecture.toml");
    let job = job(&scene, &Settings::for_scene(&scene));
    let own = state(&job, job.effects());
    let (mut more, mut same) = (Vec::new(), 0);
    for (row, _) in job.effects().rows().filter(|(_, r)| r.is_empty()) {
        let Ok(with) = forced(&job, row.effect) else {
            continue;
        };
        let with = state(&with, with.effects());
        eprintln!("{}: {with} for {own} bytes", row.name);
        match with.cmp(&own) {
            std::cmp::Ordering::Greater => more.push(row.effect),
            std::cmp::Ordering::Equal => same += 1,
            std::cmp::Ordering::Less => panic!("{}: {with} for {own} bytes", row.name),
        }
    }
    assert!(same > 10, "{same}");
    let named = |name: &&str| Effect::named(name).expect("an effect");
    let known = STATEFUL.iter().map(named).collect::<Vec<_>>();
    assert_eq!(more, known);
}
