//! Options that choose from a list: the words are the names that the library has for what they choose.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::backend::BackendKind;
use crate::sampler::Sampler;
use crate::scene::color_map::Map;
use crate::settings::{GeometryChoice, Integrator, LightSampling, View};

/// Lets `value_enum` take the names of a type's `ALL`.
macro_rules! choices {
    ($($name:ident),*) => {
        $(
            impl ValueEnum for $name {
                fn value_variants<'a>() -> &'a [Self] {
                    Self::ALL
                }

                fn to_possible_value(&self) -> Option<PossibleValue> {
                    Some(PossibleValue::new(self.name()))
                }
            }
        )*
    };
}

choices! { Integrator, LightSampling, Sampler, GeometryChoice, View }

/// What should render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// A GPU, or the CPU where none can be used.
    Auto,
    /// This.
    Only(BackendKind),
}

impl Wanted {
    /// What was asked for by name.
    #[must_use]
    pub fn kind(self) -> Option<BackendKind> {
        match self {
            Self::Auto => None,
            Self::Only(kind) => Some(kind),
        }
    }
}

/// How light transport is to be estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimator {
    /// By what pays on the scene ([`crate::choice`]).
    Auto,
    /// By this.
    Only(Integrator),
}

impl Estimator {
    /// What was asked for by name.
    #[must_use]
    pub fn integrator(self) -> Option<Integrator> {
        match self {
            Self::Auto => None,
            Self::Only(integrator) => Some(integrator),
        }
    }
}

/// `auto`, or the name of an estimator.
pub(super) fn estimator() -> impl TypedValueParser<Value = Estimator> {
    let names = Integrator::ALL.iter().map(|integrator| integrator.name());
    PossibleValuesParser::new(std::iter::once("auto").chain(names)).map(|name| {
        let named = Integrator::ALL.iter().find(|i| i.name() == name);
        named.map_or(Estimator::Auto, |integrator| Estimator::Only(*integrator))
    })
}

/// Whether there is to be a radiance cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Caching {
    /// Where it pays on the scene ([`crate::choice`]).
    Auto,
    /// Wherever there can be one.
    On,
    /// No.
    Off,
}

impl Caching {
    const ALL: [Self; 3] = [Self::Auto, Self::On, Self::Off];

    /// The word on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::On => "on",
            Self::Off => "off",
        }
    }
}

/// `auto`, `on` or `off`.
pub(super) fn caching() -> impl TypedValueParser<Value = Caching> {
    PossibleValuesParser::new(Caching::ALL.map(Caching::name)).map(|word| {
        let named = Caching::ALL.into_iter().find(|c| c.name() == word);
        named.unwrap_or(Caching::Off)
    })
}

/// `auto`, or the name of what renders.
pub(super) fn backend() -> impl TypedValueParser<Value = Wanted> {
    let kinds = BackendKind::ALL.iter().map(|kind| kind.name());
    PossibleValuesParser::new(std::iter::once("auto").chain(kinds))
        .map(|name| BackendKind::of_name(&name).map_or(Wanted::Auto, Wanted::Only))
}

/// The name of a colour map.
pub(super) fn map() -> impl TypedValueParser<Value = Map> {
    PossibleValuesParser::new(Map::ALL.iter().map(|map| map.name()))
        .map(|name| Map::of_name(&name).unwrap_or_default())
}

/// `on` or `off`.
pub(super) fn switch() -> impl TypedValueParser<Value = bool> {
    PossibleValuesParser::new(["on", "off"]).map(|word| word == "on")
}
