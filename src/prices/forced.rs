//! Effects linked into a kernel that does not ask for them.

use super::Told;
use crate::effects::Effect;
use crate::job::Job;

/// The job with `effect` in its kernel, and what that needs: its images stay what they are. Or why that cannot be.
///
/// # Errors
/// With the reason.
pub fn forced(job: &Job, effect: Effect) -> Told<Job> {
    check(effect)?;
    let used: Vec<Effect> = job.effects().used().collect();
    let mut with = used.clone();
    add(effect, &mut with)?;
    let forced = job.clone().with_effects(&with[used.len()..], "forced");
    forced.map_err(|error| error.to_string())
}

/// Refuses what cannot be linked in and stay unused.
fn check(effect: Effect) -> Told<()> {
    match effect {
        Effect::Nudge
        | Effect::Ulp
        | Effect::Sobol
        | Effect::BvhCost
        | Effect::Lecture
        | Effect::Lights
        | Effect::Skylight
        | Effect::Projected
        | Effect::Table
        | Effect::Mis
        | Effect::Roulette => Err("linked in, it would be in use".into()),
        Effect::Motion
        | Effect::Gradient
        | Effect::Sky
        | Effect::TextureChecker
        | Effect::TextureNoise
        | Effect::TextureImage
        | Effect::Textured(_) => Err("it is made of what the scene has not".into()),
        _ => Ok(()),
    }
}

/// Adds an effect and the first of each list of which it needs one.
fn add(effect: Effect, to: &mut Vec<Effect>) -> Told<()> {
    if to.contains(&effect) {
        return Ok(());
    }
    to.push(effect);
    for any_of in &effect.row().needs {
        if !any_of.iter().any(|needed| to.contains(needed)) {
            let first = any_of.first().ok_or("nothing has what it needs")?;
            add(*first, to)?;
        }
    }
    Ok(())
}
