//! Ways to leave a surface: what each gets wrong, what each costs, and a picture of it.

use gpu_trace::check::{Context, Options, exits};
use gpu_trace::gpu::device::{self, DeviceChoice};
use gpu_trace::scene::Scene;
use gpu_trace::scene::load::load_str;
use gpu_trace::settings::{Offset, Rect, Settings};

use super::{compare, film_of, ours, scene};

const MODES: [Offset; 5] = [
    Offset::Exact,
    Offset::None,
    Offset::Back(1.0e-4),
    Offset::Out(1.0e-4),
    Offset::Ulp,
];

/// Paths for each radius and mode.
const TRIALS: usize = 1 << 18;

/// Prints the tables and writes `docs/images/offsets.png`.
pub(super) fn run() {
    rates();
    costs();
    picture();
}

/// Per million, in as few digits as say something.
fn per_million(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else {
        format!("{x:.0}")
    }
}

fn rates() {
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    println!(
        "Rays wrongly blocked / leaked, per million. Walls (radius above 16) are seen from a \
         distance of 1, balls from a few radii. The last column is the lecture's: spheres about \
         their centres.\n"
    );
    let names: Vec<String> = MODES.iter().map(|m| format!("`{m}`")).collect();
    println!(
        "| radius | {} | `back:0.0001`, centres |",
        names.join(" | ")
    );
    println!("|---|{}", "---|".repeat(MODES.len() + 1));
    for exponent in -5..=8 {
        let radius = 10f64.powi(exponent);
        let cell = |offset: Offset, poles: bool| {
            let options = Options {
                offset,
                ..Options::default()
            };
            let context = Context {
                gpu: gpu.clone(),
                options,
            };
            let found = exits(&context, radius, poles, TRIALS).unwrap_or_else(|e| panic!("{e}"));
            let [blocked, leaked] =
                [found.blocked_per_million(), found.leaked_per_million()].map(per_million);
            format!("{blocked} / {leaked}")
        };
        let mut cells: Vec<String> = MODES.iter().map(|m| cell(*m, true)).collect();
        cells.push(cell(Offset::Back(1.0e-4), false));
        println!("| 1e{exponent} | {} |", cells.join(" | "));
    }
    println!();
}

fn costs() {
    for name in ["lecture", "glass"] {
        let scene = scene(name);
        let names = MODES.map(|m| m.to_string());
        let mut all: Vec<_> = MODES
            .iter()
            .zip(&names)
            .map(|(offset, name)| (name.as_str(), ours(&scene, |s| s.offset = *offset, &[])))
            .collect();
        compare(&format!("`{name}` by way to leave a surface"), &mut all);
    }
}

/// Balls of a millimetre on a ground of a kilometre.
fn small_balls() -> Scene {
    let text = "
        [camera]
        position = [0.0, 0.0022, 0.009]
        look_at = [0.0, 0.0009, 0.0]
        fov = 32.0
        [image]
        width = 200
        height = 140
        [environment]
        radiance = [0.75, 0.85, 1.0]
        [material.ground]
        type = 'diffuse'
        albedo = [0.6, 0.55, 0.5]
        [material.paint]
        type = 'diffuse'
        albedo = [0.8, 0.3, 0.2]
        [material.chrome]
        type = 'mirror'
        reflectance = [0.9, 0.9, 0.9]
        [material.glass]
        type = 'dielectric'
        ior = 1.5
        [[sphere]]
        center = [0.0, -1000.0, 0.0]
        radius = 1000.0
        material = 'ground'
        [[sphere]]
        center = [-0.0021, 0.001, 0.0]
        radius = 0.001
        material = 'paint'
        [[sphere]]
        center = [0.0, 0.001, 0.0]
        radius = 0.001
        material = 'glass'
        [[sphere]]
        center = [0.0021, 0.001, 0.0]
        radius = 0.001
        material = 'chrome'
    ";
    load_str("small balls", text)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

fn picture() {
    const GAP: u32 = 4;
    let scene = small_balls();
    let (width, height) = (scene.width, scene.height);
    let across = MODES.len() as u32 * (width + GAP) - GAP;
    let mut all = image::RgbImage::from_pixel(across, height, image::Rgb([255; 3]));
    for (i, offset) in MODES.iter().enumerate() {
        let settings = Settings {
            samples: 0..1024,
            crop: Rect::whole(width, height),
            offset: *offset,
            ..Settings::for_scene(&scene)
        };
        let film = film_of(&scene, &settings);
        for (at, pixel) in film.pixels().iter().enumerate() {
            let (x, y) = (at as u32 % width, at as u32 / width);
            let byte = |v: f32| (255.0 * f64::from(v).clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8;
            all.put_pixel(i as u32 * (width + GAP) + x, y, image::Rgb(pixel.map(byte)));
        }
    }
    let path = "docs/images/offsets.png";
    all.save(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    println!("{path}: {}", MODES.map(|m| m.to_string()).join(", "));
}
