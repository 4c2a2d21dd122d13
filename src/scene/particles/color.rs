//! The colours of particles.

use glam::DVec3;

use super::super::color_map::Map;
use super::{Fault, column};
use crate::image::linear;
use crate::particles::{Element, Particles};

/// Steps of a colour map: more than the eye tells apart, and each is a material.
const STEPS: usize = 256;

/// What has no colour of its own: sRGB, 8 bit.
const UNKNOWN: [u8; 3] = [153, 153, 153];

/// What colours particles.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Coloring {
    /// Nothing: all have one material.
    #[default]
    None,
    /// Their elements: CPK colours.
    Element,
    /// Their elements, if the file says them; else nothing.
    ElementIfKnown,
    /// A column through a map.
    Column {
        /// Its name.
        name: String,
        /// The map.
        map: Map,
        /// The values at the map's ends; `None`: the least and the largest.
        range: Option<[f64; 2]>,
    },
}

/// The colours, and which of them each kept particle has.
pub(super) struct Painted {
    pub(super) colors: Vec<(String, DVec3)>,
    /// Indices into `colors`, in the order of what is kept; none where nothing colours.
    pub(super) of_kept: Vec<u16>,
    /// The values of a column at the ends of its map.
    pub(super) range: Option<[f64; 2]>,
}

/// Colours the particles `kept`.
pub(super) fn paint(
    particles: &Particles,
    coloring: &Coloring,
    kept: &[usize],
) -> Result<Painted, Fault> {
    let known = particles.elements.is_some();
    match coloring {
        Coloring::ElementIfKnown if known => paint(particles, &Coloring::Element, kept),
        Coloring::None | Coloring::ElementIfKnown => Ok(Painted {
            colors: Vec::new(),
            of_kept: Vec::new(),
            range: None,
        }),
        Coloring::Element => {
            let Some(elements) = &particles.elements else {
                return Err(Fault::new("color_by", "the file says no elements"));
            };
            let name =
                |element: Option<Element>| element.map_or("unknown", Element::symbol).to_owned();
            let color = |element: Option<Element>| element.map_or(UNKNOWN, Element::color);
            Ok(distinct(kept.iter().map(|index| elements[*index]), |e| {
                (name(e), rgb(color(e)))
            }))
        }
        Coloring::Column { name, map, range } => {
            let values = column(particles, "color_by", name)?;
            let values = kept.iter().map(|index| values[*index]);
            if let Some(at) = values.clone().position(|v| !v.is_finite()) {
                let message = format!("`{name}` of particle {} is no finite number", kept[at] + 1);
                return Err(Fault::new("color_by", message));
            }
            let [low, high] = range.unwrap_or_else(|| {
                let low = values.clone().fold(f64::INFINITY, f64::min);
                [low, values.clone().fold(f64::NEG_INFINITY, f64::max)]
            });
            let step = |value: f64| {
                // Halves, so that no difference of two of them is beyond an f64.
                let share = (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low);
                // All alike: the middle.
                let share = if share.is_nan() { 0.5 } else { share };
                ((share * STEPS as f64) as usize).min(STEPS - 1)
            };
            let gradient = map.gradient();
            let color = |step: usize| {
                let c = gradient.eval_rational(step, STEPS);
                (format!("{name} {}/{STEPS}", step + 1), rgb([c.r, c.g, c.b]))
            };
            Ok(Painted {
                range: Some([low, high]),
                ..distinct(values.map(step), color)
            })
        }
    }
}

/// Each different value has a colour.
fn distinct<T: Copy + Ord>(
    values: impl Iterator<Item = T>,
    color: impl Fn(T) -> (String, DVec3),
) -> Painted {
    let mut places = std::collections::BTreeMap::new();
    let of_kept: Vec<u16> = values
        .map(|value| {
            let next = places.len() as u16;
            *places.entry(value).or_insert(next)
        })
        .collect();
    let mut order: Vec<(T, u16)> = places.into_iter().collect();
    order.sort_by_key(|(_, place)| *place);
    Painted {
        colors: order.into_iter().map(|(value, _)| color(value)).collect(),
        of_kept,
        range: None,
    }
}

fn rgb(display: [u8; 3]) -> DVec3 {
    DVec3::from(display.map(|c| linear(f64::from(c) / 255.0)))
}
