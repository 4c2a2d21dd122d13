//! Twin of `shaders/light/skylight.wesl`.

use glam::{DVec2, DVec3};

use super::sphere::LightSample;
use crate::placement::sky::{Band, SkyTable};
use crate::sampling::directions::circle_point;
use crate::scene::Sky;

/// With lamps beside the image: how often a vertex looks for the image.
pub const SKY_SHARE: f64 = 0.5;

/// In place of a lamp's sphere: the sky.
pub const NO_SPHERE: usize = usize::MAX;

/// Which of `count` equal parts of [0, 1) the number `u` is in, and where in it.
#[must_use]
pub fn part_of(u: f64, count: u32) -> (u32, f64) {
    let place = u * f64::from(count);
    (place as u32, place.fract())
}

/// A direction to the image.
#[must_use]
pub fn sample_sky(sky: &Sky, table: &SkyTable, u: [f64; 4]) -> LightSample {
    let [width, height] = [sky.image().width, sky.image().height];
    let (place, down) = part_of(u[1], height);
    let row = table.rows()[place as usize].choose(place, u[3]);
    let (place, across) = part_of(u[0], width);
    let column = table.column(place, row).choose(place, u[2]);
    let band = Band::of(row, height);
    let s = band.square(down);
    let y = if band.lower {
        2.0 * s - 1.0
    } else {
        1.0 - 2.0 * s
    };
    let turn = (f64::from(column) + across) / f64::from(width) + sky.rotation() / 360.0;
    let p = 2.0 * (s * (1.0 - s)).sqrt() * circle_point(turn);
    let pdf = table.pdf(column, row);
    LightSample {
        wi: DVec3::new(p.y, y, -p.x),
        pdf,
        mis_pdf: pdf,
        limb: f64::INFINITY,
        sphere: NO_SPHERE,
        pdf_per_weight: 0.0,
    }
}

/// The pdf with which light sampling finds a direction at this place of the image.
#[must_use]
pub fn sky_pdf(sky: &Sky, table: &SkyTable, place: DVec2) -> f64 {
    let within = |x: f64, count: u32| (x as u32).min(count - 1);
    let image = sky.image();
    table.pdf(within(place.x, image.width), within(place.y, image.height))
}
