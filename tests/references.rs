//! Images against references of Mitsuba 3 (`tests/references/make.py`).

use std::path::Path;

use crate::equivalence::{Demand, Independent, check};
use gpu_trace::input::read;

/// Samples a pixel, in the short form and in the long one: the interval of the bias is a twentieth of a
/// percent wide at most, half of what it may be, and with the long form half of that.
const SPP: [u64; 2] = [4096, 16_384];

/// One part of the reference of a scene, and its size.
fn reference(name: &str, part: &str) -> ([u32; 2], Vec<[f64; 3]>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let read = read(&folder.join(format!("{name}.{part}.npy")));
    let picture = read.unwrap_or_else(|e| panic!("{e}")).picture;
    let pixels = picture.pixels.iter().map(|pixel| pixel.map(f64::from));
    ([picture.width, picture.height], pixels.collect())
}

fn holds(name: &str) {
    let scene = crate::common::scene_file(format!("tests/references/{name}.toml"));
    let (size, mean) = reference(name, "mean");
    assert_eq!(size, [scene.width, scene.height]);
    let other = Independent {
        mean,
        variance: reference(name, "variance").1,
        samples: 131_072.0,
    };
    let demand = Demand {
        spp: SPP[usize::from(crate::thorough::thorough())],
        equivalent: 1.0e-3,
    };
    check(name, &scene, &other, demand);
}

macro_rules! references {
    ($($name:ident),*) => { $(#[test] fn $name() { holds(stringify!($name)); })* };
}

references!(diffuse, mirror, glass, lens, emitters, mixed);
