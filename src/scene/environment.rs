//! What a path sees that hits nothing.

use glam::DVec3;
use toml::Spanned;

use super::file::{EnvironmentTable, GradientTable};
use super::report::{Problem, Report};
use super::validate::vector;

/// Light from everywhere.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance from every direction.
    Constant(DVec3),
    /// Three colours by height.
    Gradient(Gradient),
}

/// A sky by three radiances: above, mix(horizon, zenith, w.y) for the unit direction w; below, the ground's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// From straight above, +y.
    pub zenith: DVec3,
    /// From the horizon.
    pub horizon: DVec3,
    /// From everywhere below the horizon.
    pub ground: DVec3,
}

impl Environment {
    /// The radiance of a constant environment; `None` of any other.
    #[must_use]
    pub fn constant(&self) -> Option<DVec3> {
        match self {
            Self::Constant(radiance) => Some(*radiance),
            Self::Gradient(_) => None,
        }
    }

    /// The largest radiance of any channel from any direction.
    #[must_use]
    pub fn brightest(&self) -> f64 {
        match self {
            Self::Constant(radiance) => radiance.max_element(),
            Self::Gradient(Gradient {
                zenith,
                horizon,
                ground,
            }) => zenith.max(*horizon).max(*ground).max_element(),
        }
    }
}

/// What `[environment]` asks for; `None` for black, and after errors, which the report then holds.
pub(super) fn environment(
    table: &Spanned<EnvironmentTable>,
    report: &mut Report,
) -> Option<Environment> {
    let EnvironmentTable { radiance, gradient } = table.get_ref();
    let given = [
        ("radiance", radiance.as_ref().map(Spanned::span)),
        ("gradient", gradient.as_ref().map(Spanned::span)),
    ];
    let mut given = given.iter().filter_map(|(key, span)| Some((*key, span.clone()?)));
    let Some((first, first_span)) = given.next() else {
        let message = "`radiance` or `gradient` is missing in `[environment]`";
        let problem = Problem::new(table.span(), message, "");
        let help = "`radiance = [1.0, 1.0, 1.0]` is the same light from everywhere";
        report.errors.push(problem.help(help));
        return None;
    };
    if let Some((second, span)) = given.next() {
        let message = format!("`{second}` and `{first}` do not go together in `[environment]`");
        let problem = Problem::new(span, message, "").also(first_span, "the other one");
        report.errors.push(problem.help("an environment is one of them"));
        return None;
    }
    let environment = match (radiance, gradient) {
        (Some(radiance), _) => Environment::Constant(vector(*radiance.get_ref())),
        (_, Some(gradient)) => Environment::Gradient(of_table(gradient.get_ref())),
        (None, None) => return None,
    };
    Some(environment).filter(|environment| environment.brightest() > 0.0)
}

fn of_table(table: &GradientTable) -> Gradient {
    Gradient {
        zenith: vector(table.zenith),
        horizon: vector(table.horizon),
        ground: vector(table.ground),
    }
}
