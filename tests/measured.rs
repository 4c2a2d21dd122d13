//! Measured materials: files of the MERL database. None can be shipped, so these are written here, by the format's
//! published layout and not by the program's.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use glam::{DMat3, DVec3};
use gpu_trace::error::Error;
use gpu_trace::materials::conductor::Conductor;
use gpu_trace::materials::measured::{BrdfTable, Measured, parse};
use gpu_trace::materials::nylon::Nylon;
use gpu_trace::materials::{Bsdf, MaterialKind, Surface};
use gpu_trace::scene::load::{Loaded, load_str_in};
use gpu_trace::scene::summary;
use gpu_trace::settings::Integrator;
use gpu_trace::statistics::{mean_and_error, normal_limit};
use gpu_trace::verify::bsdf::Subjects;
use gpu_trace::verify::bsdf::twin::{Wrong, samples, values};
use gpu_trace::verify::{Random, ULP};
use rayon::prelude::*;

use crate::cli_support::{Folder, GOOD};
use crate::common::gpu;
use crate::common::images::assert_same;

/// Entries of a channel.
const COUNT: usize = 90 * 90 * 180;
/// What the format multiplies values by.
const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// Directions of which means are taken.
const SAMPLES: u32 = 50_000;

/// A file with these values.
fn file(values: impl Fn(usize) -> f64 + Sync) -> Vec<u8> {
    let header = [90i32, 90, 180].into_iter().flat_map(i32::to_le_bytes);
    let values: Vec<[u8; 8]> = (0..3 * COUNT)
        .into_par_iter()
        .map(|place| values(place).to_le_bytes())
        .collect();
    header.chain(values.into_iter().flatten()).collect()
}

fn place(channel: usize, [i, j, k]: [usize; 3]) -> usize {
    ((channel * 90 + i) * 90 + j) * 180 + k
}

fn flat() -> Surface {
    Surface {
        normal: DVec3::Z,
        eta: 1.0,
        offset: DVec3::ZERO,
    }
}

/// The directions o and i with these half and difference angles in degrees, by rotations, about the normal +z.
fn pair(theta_h: f64, theta_d: f64, phi_d: f64, phi_h: f64) -> [DVec3; 2] {
    let turned = DMat3::from_rotation_z(phi_h.to_radians());
    let leaning = DMat3::from_rotation_y(theta_h.to_radians());
    let about = turned * leaning * DMat3::from_rotation_z(phi_d.to_radians());
    let difference = |theta: f64| about * (DMat3::from_rotation_y(theta.to_radians()) * DVec3::Z);
    [difference(-theta_d), difference(theta_d)]
}

/// The file of a material, which is asked at the entries.
fn file_of(material: &(dyn Bsdf + Sync)) -> Vec<u8> {
    file(|place| {
        let (channel, i) = (place / COUNT, place / 16_200 % 90);
        let (j, k) = (place / 180 % 90, place % 180);
        let theta_h = 90.0 * (i as f64 / 90.0).powi(2);
        let [o, i] = pair(theta_h, j as f64, k as f64, 0.0);
        let f = match o.z > 0.0 && i.z > 0.0 {
            true => material.evaluate(&flat(), o, i).f_cos / i.z,
            // As where nothing was measured.
            false => DVec3::splat(-1.0),
        };
        f[channel] / SCALES[channel]
    })
}

static NYLON: LazyLock<Vec<u8>> = LazyLock::new(|| file_of(&Nylon::default()));

/// A file that was measured of nylon.
pub(crate) fn nylon_file() -> &'static [u8] {
    &NYLON
}

/// A file that was measured of copper of a roughness of 0.4.
pub(crate) fn metal_file() -> Vec<u8> {
    file_of(&Conductor {
        roughness: 0.4,
        ..metal()
    })
}

fn measured(bytes: &[u8]) -> Measured {
    let table = parse(bytes).unwrap_or_else(|e| panic!("{e}"));
    Measured::of("test.binary", Arc::new(table), DVec3::ONE)
}

fn brdf(material: &dyn Bsdf, [o, i]: [DVec3; 2]) -> DVec3 {
    material.evaluate(&flat(), o, i).f_cos / i.z
}

#[test]
fn entries_are_where_the_format_has_them() {
    // Each another value; the places that follow are off by half of an entry in each angle.
    let counted = measured(&file(|place| place as f64));
    let entry = |index: [usize; 3], channel| place(channel, index) as f64 * SCALES[channel];
    let mean = |places: &[[usize; 3]], channel| {
        let all = places.iter().map(|index| entry(*index, channel));
        all.sum::<f64>() / places.len() as f64
    };
    let half_h = |i: f64| 90.0 * (i / 90.0).powi(2);
    let off = |[theta_h, theta_d, phi_d]: [f64; 3], places: &[[usize; 3]]| {
        let far = |phi_h: f64, period: f64| {
            let f = brdf(&counted, pair(theta_h, theta_d, phi_d + period, phi_h));
            let far = |channel: usize| (f[channel] / mean(places, channel) - 1.0).abs();
            (0..3).map(far).fold(0.0, f64::max)
        };
        let all = [(0.0, 0.0), (77.0, 0.0), (-130.0, 180.0)].map(|(phi, period)| far(phi, period));
        all.into_iter().fold(0.0, f64::max)
    };
    // Entries are rounded to f32.
    for (angles, places) in [
        ([half_h(9.0), 30.0, 50.0], &[[9, 30, 50]][..]),
        ([half_h(40.0), 1.0, 0.0], &[[40, 1, 0]]),
        ([half_h(1.0), 70.0, 179.0], &[[1, 70, 179]]),
        ([half_h(9.5), 30.0, 50.0], &[[9, 30, 50], [10, 30, 50]]),
        ([half_h(9.0), 30.5, 50.0], &[[9, 30, 50], [9, 31, 50]]),
        ([half_h(9.0), 30.0, 50.5], &[[9, 30, 50], [9, 30, 51]]),
        // On around, and to the end.
        ([half_h(9.0), 30.0, 179.5], &[[9, 30, 179], [9, 30, 0]]),
        ([half_h(89.5), 0.5, 90.0], &[[89, 0, 90], [89, 1, 90]]),
        ([half_h(2.0), 89.6, 90.0], &[[2, 89, 90]]),
    ] {
        let found = off(angles, places);
        assert!(found <= 2.0 * ULP, "{angles:?}: off by {found:e}");
        // Companion: the next entry.
        let wrong = [[places[0][0], places[0][1], places[0][2] ^ 1]];
        assert!(off(angles, &wrong) > 2.0 * ULP, "{angles:?}");
    }
    // Where nothing was measured, nothing is scattered.
    let negative = measured(&file(|place| if place < COUNT { -3.0 } else { 1.0 }));
    let f = brdf(&negative, pair(20.0, 30.0, 40.0, 0.0));
    assert_eq!(f.x, 0.0);
    assert!((f.y / SCALES[1] - 1.0).abs() < ULP && (f.z / SCALES[2] - 1.0).abs() < ULP);
    // A mirror's direction, and one along the normal.
    assert!(brdf(&counted, [DVec3::Z; 2]).is_finite());
}

/// The value of a material at such indices by theta_h, theta_d and phi_d as its table has, or between them.
fn asked(material: &dyn Bsdf, [h, d, phi]: [f64; 3]) -> DVec3 {
    brdf(material, pair(h * h / 90.0, d, phi, 0.0))
}

/// What linear interpolation is off at most, by channel: half of the largest second difference over an entry in each
/// angle. It is an eighth of that where the function is smooth; the rest is for edges, whose difference is halved where
/// they lie between, and for differences that are others at the corners of a cell.
fn bound(truth: &dyn Bsdf, at: [f64; 3]) -> DVec3 {
    let along = |angle: usize| {
        let moved = |by: f64| {
            let mut at = at;
            at[angle] += by;
            asked(truth, at)
        };
        let bend = |by: f64| (moved(by - 1.0) - 2.0 * moved(by) + moved(by + 1.0)).abs();
        bend(-1.0).max(bend(0.0)).max(bend(1.0))
    };
    // Entries are rounded to f32.
    0.5 * (along(0) + along(1) + along(2)) + 2.0 * ULP * asked(truth, at)
}

/// Errors of a table against what it was made of, over their bounds, where both directions are well above the horizon.
fn errors(table: &dyn Bsdf, truth: &dyn Bsdf) -> Vec<f64> {
    let mut random = Random::new("interpolation");
    let places = (0..20_000).map(|_| {
        let [h, d, phi, _] = random.unit4().map(f64::from);
        [89.0 * h, 89.0 * d, 180.0 * phi]
    });
    let above = |[h, d, phi]: &[f64; 3]| {
        let both = pair(h * h / 90.0, *d, *phi, 0.0);
        both.iter().all(|w| w.z > 0.25)
    };
    let error = |at| {
        let off = asked(table, at) - asked(truth, at);
        (off.abs() / bound(truth, at)).max_element()
    };
    places.filter(above).map(error).collect()
}

#[test]
fn a_table_of_nylon_is_nylon() {
    let (table, nylon) = (measured(&NYLON), Nylon::default());
    let found = errors(&table, &nylon);
    let worst = found.iter().copied().fold(0.0, f64::max);
    eprintln!("{} places, the worst {worst:.3} of its bound", found.len());
    assert!(found.len() > 10_000 && worst <= 1.0, "{worst}");
    // Companion: an index that is 1 % larger.
    let other = Nylon {
        ior: 1.01 * nylon.ior,
        ..nylon.clone()
    };
    let others = errors(&table, &other);
    let beyond = others.iter().filter(|error| **error > 1.0).count();
    eprintln!("{beyond} are beyond with another index");
    assert!(2 * beyond > others.len(), "{beyond} of {}", others.len());
    // And so is its light, but for samples' noise, and for what comes from within two degrees, the largest distance of
    // entries, of the horizon: entries next to those below are darker.
    let [own, nylons] =
        [&table as &dyn Bsdf, &nylon].map(|material| light_by(material, material, 45.0));
    let lost = 2_f64.to_radians().sin().powi(2);
    let off = |factor: f64| {
        let channel = |c: usize| {
            let [(own, error), (wanted, other)] = [own[c], nylons[c]];
            let limit = normal_limit(3) * error.hypot(other) + lost * wanted;
            (factor * own - wanted).abs() / limit
        };
        (0..3).map(channel).fold(0.0, f64::max)
    };
    assert!(off(1.0) < 1.0, "{own:?} for {nylons:?}");
    // Companion.
    assert!(off(0.99) > 1.0, "{own:?} for {nylons:?}");
}

#[test]
fn the_device_reads_whole_tables() {
    let both = [measured(&metal_file()), measured(&NYLON)];
    let kinds = both.map(MaterialKind::from).into();
    let subjects = Subjects::of(&gpu(), kinds, Integrator::Bsdf);
    for subject in 0..2 {
        let drawn = |wrong| samples(&subjects, subject, 2000, wrong).expect("the probe runs");
        let valued = |wrong| values(&subjects, subject, 2000, wrong).expect("the probe runs");
        for ask in [&drawn as &dyn Fn(Wrong) -> _, &valued] {
            let found = ask(Wrong::default());
            eprint!("{subject}: {} of {} on an edge; ", found.edges, found.cases);
            found.agreement.assert_holds(found.cases);
            assert!(5 * found.edges <= found.cases);
            let other = Wrong {
                turn: 0.0,
                next: true,
            };
            assert!(ask(other).agreement.any_fails());
        }
    }
}

fn metal() -> Conductor {
    let text = GOOD.replace(
        "type = \"diffuse\"\nalbedo = [0.9, 0.8, 0.7]",
        "type = \"conductor\"\npreset = \"copper\"",
    );
    let loaded = load_str_in("scene", &text, Path::new("")).expect("good");
    let white = loaded
        .scene
        .materials
        .into_iter()
        .find(|m| m.name == "white");
    match white.expect("it is there").kind {
        MaterialKind::Conductor(metal) => metal,
        other => panic!("{other:?}"),
    }
}

/// The direction at an angle to the normal.
fn at_angle(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

/// The mean of samples' weights at an angle, by channel, and its standard error. `by`: whose directions are sampled.
fn light_by(by: &dyn Bsdf, material: &dyn Bsdf, degrees: f64) -> [(f64, f64); 3] {
    let mut random = Random::new("weights");
    let wo = at_angle(degrees);
    let weights: Vec<DVec3> = (0..SAMPLES)
        .map(|_| {
            let sample = by.sample(&flat(), wo, random.unit4().map(f64::from));
            let value = material.evaluate(&flat(), wo, sample.wi);
            match sample.pdf > 0.0 {
                true => value.f_cos / sample.pdf,
                false => DVec3::ZERO,
            }
        })
        .collect();
    [0, 1, 2].map(|channel| {
        let all: Vec<f64> = weights.iter().map(|w| w[channel]).collect();
        mean_and_error(&all)
    })
}

/// Their variance over the square of their mean, the largest of all channels.
fn spread_by(by: &dyn Bsdf, material: &dyn Bsdf, degrees: f64) -> f64 {
    let of = light_by(by, material, degrees).map(|(mean, error)| (error / mean).powi(2));
    of.into_iter().fold(0.0, f64::max) * f64::from(SAMPLES)
}

#[test]
fn what_is_fitted_leaves_little() {
    // Half of what the lobe of any other of these leaves at least, whose alpha is 1.8 times as large or more: by so much
    // a fit may be off.
    const LIMIT: f64 = 0.3;
    // Metals from narrow to wide lobes, which a lobe of their own kind fits.
    let tables = [0.15, 0.3, 0.5, 0.8].map(|roughness| {
        let rough = Conductor {
            roughness,
            ..metal()
        };
        measured(&file_of(&rough))
    });
    for (i, table) in tables.iter().enumerate() {
        for degrees in [20.0, 45.0, 70.0] {
            let found = [0, 1, 2, 3].map(|by| spread_by(&tables[by], table, degrees));
            eprintln!("metal {i} at {degrees}: {found:.3?}");
            assert!(found[i] <= LIMIT, "metal {i} at {degrees}: {found:?}");
            // Companion.
            let mut others = (0..4).filter(|by| *by != i);
            let all = others.all(|by| found[by] > 2.0 * LIMIT);
            assert!(all, "metal {i} at {degrees}: {found:?}");
        }
    }
    // Where there is no lobe, the cosine alone leaves nothing but rounding to f32; of a narrow one, nearly everything.
    let dull = BrdfTable::sampled([2, 2, 2], |_, _| DVec3::splat(0.1));
    assert!(dull.lobe().lobe.iter().all(|share| *share < 1.0e-4));
    let dull = Measured::of("dull", Arc::new(dull), DVec3::ONE);
    assert!(spread_by(&dull, &dull, 45.0) < 1.0e-6);
    assert!(spread_by(&dull, &tables[0], 45.0) > 10.0);
    // Nylon, which a lobe of another kind has to do for: twice as well as those of the metals and as none.
    let nylon = measured(&NYLON);
    let found = spread_by(&nylon, &nylon, 45.0);
    let others = tables.iter().chain([&dull]);
    let others: Vec<f64> = others.map(|by| spread_by(by, &nylon, 45.0)).collect();
    eprintln!("nylon: {found:.3}, {others:.3?}");
    let all = others.iter().all(|other| 2.0 * found < *other);
    assert!(all, "{found}, {others:?}");
}

// ---- Files ----

/// A scene whose white material, in line 12, is measured, the file being named in line 14.
fn scene_of(lines: &str) -> String {
    GOOD.replace(
        "type = \"diffuse\"\nalbedo = [0.9, 0.8, 0.7]",
        &format!("type = \"measured\"\n{lines}"),
    )
}

fn load(folder: &Folder, lines: &str) -> Result<Loaded, Error> {
    load_str_in("scene", &scene_of(lines), &folder.path(""))
}

#[test]
fn files_are_read_once_and_count_by_their_content() {
    let folder = Folder::new();
    folder.write("a.binary", &*NYLON);
    folder.write("b.binary", &*NYLON);
    let hash = |lines: &str| load(&folder, lines).unwrap_or_else(|e| panic!("{e}")).hash;
    let plain = hash("file = \"a.binary\"");
    assert_eq!(plain, hash("file = \"b.binary\"\nscale = [1, 1, 1]"));
    assert_ne!(plain, hash("file = \"a.binary\"\nscale = 0.5"));
    let two = scene_of("file = \"a.binary\"").replace(
        "type = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]",
        "type = \"measured\"\nfile = \"a.binary\"\nscale = 0.5",
    );
    let loaded = load_str_in("scene", &two, &folder.path("")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.files, [folder.path("").join("a.binary")]);
    let materials = loaded.scene.materials.iter();
    let tables: Vec<_> = materials.filter_map(|m| m.kind.table()).collect();
    assert!(tables.len() == 2 && Arc::ptr_eq(tables[0], tables[1]));
    let words = summary(&loaded);
    for part in ["measured     2", "white: a.binary", "chrome: a.binary"] {
        assert!(words.contains(part), "{part:?} is not in {words}");
    }
    // What gains light is said to.
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let bright = load(&folder, "file = \"a.binary\"\nscale = 5").expect("good");
    let says = "gains energy: at some angles it scatters 2.2";
    assert!(bright.warnings[0].contains(says), "{:?}", bright.warnings);
}

#[test]
fn what_is_no_table_is_refused() {
    let folder = Folder::new();
    let refused = |lines: &str, line: u32, says: &[&str]| {
        let error = load(&folder, lines).expect_err(lines).to_string();
        let place = format!("scene:{line}:");
        for part in says.iter().chain([&place.as_str()]) {
            assert!(error.contains(part), "{part:?} is not in {error}");
        }
    };
    refused(
        "file = \"none.binary\"",
        14,
        &["cannot read", "none.binary"],
    );
    refused("file = \".\"", 14, &["is no regular file"]);
    refused("scale = 2", 12, &["`file` is missing"]);
    refused("file = 3", 14, &["`file` must be a string"]);
    refused("file = \"a\"\nscale = -1", 15, &["`scale`", "negative"]);
    refused(
        "file = \"a\"\nscale = [1, nan, 1]",
        15,
        &["`scale`", "finite"],
    );
    refused("file = \"a\"\naxes = 1", 15, &["unknown key `axes`"]);
    let write = |bytes: &[u8]| folder.write("a.binary", bytes);
    let named = "file = \"a.binary\"";
    write(&NYLON[..7]);
    refused(named, 14, &["a.binary: it has 7 bytes", "truncated"]);
    write(&NYLON[..NYLON.len() - 8]);
    refused(
        named,
        14,
        &["it has 34992004 bytes, and a MERL file 34992012: it is truncated"],
    );
    let mut bytes = NYLON.clone();
    bytes.push(0);
    write(&bytes);
    refused(named, 14, &["something follows the table"]);
    bytes.pop();
    bytes[4] = 45;
    write(&bytes);
    refused(named, 14, &["the table's sizes, are 90, 45 and 180"]);
    for (value, shown) in [
        (f64::NAN, "is NaN"),
        (f64::INFINITY, "is inf"),
        (-f64::INFINITY, "is -inf"),
        (1.0e24, "is 1000000000000000000000000"),
    ] {
        let at = place(1, [3, 4, 5]);
        let mut bytes = NYLON.clone();
        bytes[12 + 8 * at..][..8].copy_from_slice(&value.to_le_bytes());
        write(&bytes);
        refused(
            named,
            14,
            &[
                "its green value 3, 4, 5 (by theta_h, theta_d, phi_d)",
                shown,
            ],
        );
    }
}

#[test]
fn wrong_scenes_exit_with_2_and_tables_go_with_film_files() {
    let folder = Folder::new();
    folder.write("bad.toml", scene_of("file = \"none.binary\""));
    let says = folder.refused(&["scene", "check", "bad.toml"]);
    assert!(
        says.contains("bad.toml:14:") && says.contains("none.binary"),
        "{says}"
    );
    #[cfg(unix)]
    {
        folder.write("device.toml", scene_of("file = \"/dev/zero\""));
        let says = folder.refused(&["device.toml", "-o", "x.npy"]);
        assert!(says.contains("/dev/zero is no regular file"), "{says}");
    }
    folder.write("a.binary", &*NYLON);
    folder.write("scene.toml", scene_of("file = \"a.binary\""));
    let small = "scene.toml --backend cpu --size 8x6";
    let (whole, _) = folder.render(&format!("{small} --spp 32"));
    folder.ok(&format!("{small} --spp 16 --checkpoint a.film -o x.npy"));
    folder.ok("resume a.film --spp 32");
    assert_same("resumed with tables", &folder.npy("x.npy"), &whole);
    let mut other = NYLON.clone();
    let last = other.len() - 1;
    other[last] ^= 1;
    folder.write("a.binary", other);
    let says = folder.refused(&["resume", "a.film", "--spp", "64", "-o", "y.npy"]);
    assert!(says.contains("a.binary has changed"), "{says}");
}
