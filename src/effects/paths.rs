//! Effects of how paths go on and where they end.

use super::{Effect, Row, when};
use crate::settings::Integrator;

pub(super) fn rows() -> Vec<Row> {
    let lecture = |integrator| matches!(integrator, Integrator::Lecture { .. });
    vec![
        Row::new(
            Effect::Lecture,
            "lecture",
            "uniform hemisphere, constant probability of termination",
            move |asked| {
                when(lecture(asked.settings.integrator), || {
                    "--integrator lecture".into()
                })
            },
        )
        .marks(["LECTURE_TERMINATION"]),
        Row::new(
            Effect::Roulette,
            "roulette",
            "Russian roulette on the throughput",
            move |asked| {
                let integrator = asked.settings.integrator;
                when(asked.settings.roulette && !lecture(integrator), || {
                    format!("integrator {}", integrator.name())
                })
            },
        )
        .excludes([Effect::Lecture])
        .marks(["ROULETTE_FACTOR"]),
    ]
}
