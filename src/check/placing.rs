//! Cases 2, 5 and 10 to 15: where things are. Whole renders; the truth is another render that must
//! be the same, the f64 reference on the same paths, or a number.

use super::Case;
use super::context::Context;
use crate::error::Result;
use crate::film::Film;
use crate::scene::Scene;
use crate::scene::load::load_str;
use crate::settings::Settings;
use crate::verify::{Measure, SceneText, image_bits, means, share_off};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 2,
        name: "a scene far from the origin",
        setup: "moved by (d, -d, d): the same bits for d = 2^k up to 2^26, where sums are exact in \
                f64; for d = 1e7/3, share of the values that are off by more than 0.1 %",
        run: moved,
    },
    Case {
        id: 5,
        name: "a scene of any size",
        setup: "scaled by 2^k, k = -20 to 20: the same bits",
        run: scaled,
    },
    Case {
        id: 10,
        name: "spheres of radius 1e20",
        setup: "ground and scene of radius up to 1e20, and down to 1e-20: as the f64 reference",
        run: extreme,
    },
    Case {
        id: 11,
        name: "lamps buried at a point of contact",
        setup: "a lamp within an opaque sphere that it touches from inside, radius 1e-3 to 1e6, \
                camera outside; and one behind the wall of a room: nothing of it is seen",
        run: buried,
    },
    Case {
        id: 12,
        name: "coincident spheres",
        setup: "every sphere of a scene twice, opaque and glass: the same bits as without",
        run: coincident,
    },
    Case {
        id: 13,
        name: "thin glass shells",
        setup: "concentric spheres with gaps of 1e-2 to 1e-9 of the radius, air or denser glass \
                inside, in a constant environment: energy, and the reference on the same paths",
        run: shells,
    },
    Case {
        id: 14,
        name: "nested and overlapping dielectrics",
        setup: "overlapping balls in a constant environment, seen from outside and inside, are \
                white; an inner ball of the same index cannot be seen",
        run: nested,
    },
    Case {
        id: 15,
        name: "values that are no scene",
        setup: "radius 0, negative, NaN, infinite, above 1e20, a camera at its own aim: refused \
                with the line",
        run: refused,
    },
];

/// A room of spheres of many kinds and sizes, at `place` and `scale` times as large. All numbers are
/// short binary fractions, so that sums with powers of two are exact in f64. The reflective material
/// is there for its weight: it depends on every bit of the directions, as no other one does.
fn room(place: [f64; 3], scale: f64) -> Result<Scene> {
    let at = |x: f64, y: f64, z: f64| {
        [
            place[0] + scale * x,
            place[1] + scale * y,
            place[2] + scale * z,
        ]
    };
    SceneText::new(at(0.0, 0.5, 4.0), at(0.0, 0.25, 0.0))
        .environment(0.5)
        .diffuse("ground", 0.5, 0.0)
        .diffuse("lamp", 0.25, 4.0)
        .material("mirror", "type = \"mirror\"\nreflectance = [0.9, 0.8, 0.7]")
        .material(
            "glossy",
            "type = \"reflective\"\nalbedo = [0.5, 0.4, 0.3]\nspecular = [1.0, 1.0, 1.0]\n\
             epsilon = 0.01\nmu = 5.0",
        )
        .dielectric("glass", 1.5)
        .sphere(at(0.0, -1024.5, 0.0), scale * 1024.0, "glossy")
        .sphere(at(-1.0, 0.0, 0.0), scale * 0.5, "mirror")
        .sphere(at(0.0, 0.0, 0.5), scale * 0.5, "glass")
        .sphere(at(1.0, 0.0, 0.0), scale * 0.5, "ground")
        .sphere(at(0.25, 1.5, -0.5), scale * 0.25, "lamp")
        .load()
}

/// Adds two images that must have the same bits.
fn same(measure: &mut Measure, a: &Film, b: &Film, what: &str) {
    let (a, b) = (image_bits(a), image_bits(b));
    let different = a.iter().zip(&b).filter(|(x, y)| x != y).count();
    measure.count(a.len() as u64, different as u64, || what.to_owned());
}

/// The share that may be off: a path that passes within a rounding of a silhouette goes its own way.
const OFF: f64 = 0.02;

fn moved(context: &Context) -> Result<Measure> {
    let base = room([0.0; 3], 1.0)?;
    let settings = context.settings(&base, 24, 64);
    let film = context.render(&base, &settings)?;
    let mut measure = Measure::new(0.0, "values that differ");
    let all: &[i32] = &[4, 26, 10, 17, 23];
    for &k in context.size(&all[..2], all) {
        let d = f64::from(k).exp2();
        let scene = room([d, -d, d], context.disturbed(1.0e-4))?;
        let other = context.render(&scene, &settings)?;
        same(&mut measure, &film, &other, &format!("d = 2^{k}"));
    }
    // Sums that are not exact move the scene by some 1e-9.
    let d = 1.0e7 / 3.0;
    let share = share_off(&context.render(&room([d, -d, d], 1.0)?, &settings)?, &film);
    let off = u64::from(share > OFF);
    measure.count(1, off, || format!("d = {d}: {share} of the values are off"));
    Ok(measure)
}

fn scaled(context: &Context) -> Result<Measure> {
    let base = room([0.0; 3], 1.0)?;
    let settings = context.settings(&base, 24, 64);
    let film = context.render(&base, &settings)?;
    let mut measure = Measure::new(0.0, "values that differ");
    let all: Vec<i32> = (-20..=20).filter(|k| *k != 0).collect();
    for k in context.size(vec![-20, 1, 20], all) {
        let scale = f64::from(k).exp2() * context.disturbed(1.0e-4);
        let other = context.render(&room([0.0; 3], scale)?, &settings)?;
        same(&mut measure, &film, &other, &format!("scaled by 2^{k}"));
    }
    Ok(measure)
}

fn extreme(context: &Context) -> Result<Measure> {
    let lamp = |radius: f64, camera: f64| {
        SceneText::new([0.0, 0.2 * camera, camera], [0.0; 3])
            .environment(1.0)
            .diffuse("ground", 0.5, 0.0)
            .diffuse("lamp", 0.5, 2.0)
            .sphere([0.0, -radius, 0.0], radius, "ground")
            .sphere([0.0, 0.25 * camera, 0.0], 0.25 * camera, "lamp")
    };
    let mut measure = Measure::new(OFF, "of the values off");
    for (radius, camera) in [
        (1.0e20, 1.0),
        (1.0e20, 1.0e19),
        (1.0e-20, 1.0e-20),
        (1.0, 1.0e-20),
    ] {
        let scene = lamp(radius, camera).load()?;
        let truth = lamp(radius, camera * context.disturbed(0.3)).load()?;
        let settings = context.settings(&scene, 16, 64);
        let film = context.render(&scene, &settings)?;
        let broken = film.tally().non_finite;
        let share = share_off(&film, &context.reference(&truth, &settings)?);
        let share = if broken > 0 { f64::INFINITY } else { share };
        measure.add(share, || {
            format!("ground of {radius:e}, camera at {camera:e}, {broken} not finite")
        });
    }
    Ok(measure)
}

/// Pixels that are not black.
fn lit(film: &Film) -> u64 {
    let pixels = 0..film.rect().pixels();
    let bright = |i: &usize| film.mean(*i).iter().any(|c| *c != 0.0);
    pixels.filter(bright).count() as u64
}

fn buried(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(0.0, "pixels that see it");
    let mut add = |text: SceneText, what: String| -> Result<()> {
        let scene = text.load()?;
        let film = context.render(&scene, &context.settings(&scene, 48, 256))?;
        measure.count(film.rect().pixels() as u64, lit(&film), || what);
        Ok(())
    };
    // The disturbance lets the lamp stand out.
    let out = context.disturbed(0.1) - 1.0;
    let all: &[f64] = &[1.0, 1.0e4, 1.0e-3, 30.0, 1.0e6];
    for &radius in context.size(&all[..2], all) {
        // They touch at the origin, in the middle of the image.
        for share in [0.75, 0.01] {
            let lamp = share * radius;
            let view = radius.min(4.0);
            let text = SceneText::new([0.0, 0.0, 2.0 * view], [0.0; 3])
                .diffuse("wall", 0.8, 0.0)
                .diffuse("lamp", 0.0, 1.0)
                .sphere([0.0, 0.0, -radius], radius, "wall")
                .sphere([0.0, 0.0, out * lamp - lamp], lamp, "lamp");
            add(text, format!("radius {radius:e}, lamp of {lamp:e}"))?;
        }
    }
    let text = SceneText::new([0.0, 0.0, 0.5], [0.0; 3])
        .diffuse("wall", 0.8, 0.0)
        .diffuse("lamp", 0.0, 1.0)
        .sphere([0.0; 3], 1.0, "wall")
        .sphere([0.0, 0.0, -1.5 + 10.0 * out], 0.5, "lamp");
    add(text, "behind the wall of a room".into())?;
    Ok(measure)
}

fn coincident(context: &Context) -> Result<Measure> {
    let scene = |twice: bool| {
        let mut text = SceneText::new([0.0, 0.5, 4.0], [0.0; 3])
            .environment(0.5)
            .diffuse("paint", 0.5, 0.0)
            .diffuse("other", 0.9, 3.0)
            .dielectric("glass", 1.5)
            .dielectric("denser", 1.8);
        let spheres = [
            ([0.0, -100.5, 0.0], 100.0, "paint", "other"),
            ([-0.6, 0.0, 0.0], 0.5, "glass", "denser"),
            ([0.6, 0.0, 0.0], 0.5, "paint", "paint"),
        ];
        for (center, radius, first, second) in spheres {
            text = text.sphere(center, radius, first);
            if twice {
                // The disturbance: not quite coincident.
                text = text.sphere(center, radius * context.disturbed(1.0e-2), second);
            }
        }
        text.load()
    };
    let (once, twice) = (scene(false)?, scene(true)?);
    let settings = context.settings(&once, 24, 64);
    let mut measure = Measure::new(0.0, "values that differ");
    let film = context.render(&once, &settings)?;
    same(
        &mut measure,
        &film,
        &context.render(&twice, &settings)?,
        "each sphere twice",
    );
    Ok(measure)
}

/// Largest deviation of a pixel from `expected`, for paths that the bounce limit does not cut.
fn deviation(film: &Film, expected: f64) -> f64 {
    // What is no number is the largest deviation of all.
    means(film)
        .iter()
        .map(|m| (m / expected - 1.0).abs())
        .map(|x| if x.is_nan() { f64::INFINITY } else { x })
        .fold(0.0, f64::max)
}

fn shells(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0e-3, "relative");
    let all: &[f64] = &[1.0e-9, 1.0e-3, 1.0e-2, 1.0e-4, 1.0e-5, 1.0e-6, 1.0e-7];
    for &gap in context.size(&all[..2], all) {
        for (name, inner) in [("air", 1.0), ("denser", 1.9)] {
            let text = SceneText::new([0.0, 0.0, 4.0], [0.0; 3])
                .environment(1.0)
                .dielectric("outer", 1.5)
                .dielectric("inner", inner)
                .sphere([0.1, 0.2, 0.3], 1.0, "outer")
                .sphere([0.1, 0.2, 0.3], 1.0 - gap, "inner");
            let scene = text.load()?;
            let settings = white_settings(context, &scene);
            let film = context.render(&scene, &settings)?;
            let expected = context.disturbed(1.0e-2);
            measure.add(deviation(&film, expected), || {
                format!("gap {gap:e}, {name} inside: energy")
            });
            // The same without the environment, but a lamp: where the light goes.
            let scene = lit_shell(gap, inner, 1.0)?;
            let truth = lit_shell(gap, inner, context.disturbed(0.05))?;
            let settings = context.settings(&scene, 24, 64);
            let film = context.render(&scene, &settings)?;
            let reference = context.reference(&truth, &settings)?;
            let bias = mean_of(&film) / mean_of(&reference) - 1.0;
            measure.add(bias.abs(), || {
                format!("gap {gap:e}, {name} inside: mean against f64")
            });
        }
    }
    Ok(measure)
}

fn lit_shell(gap: f64, inner: f64, emission: f64) -> Result<Scene> {
    SceneText::new([0.0, 0.0, 4.0], [0.0; 3])
        .diffuse("lamp", 0.5, emission)
        .dielectric("outer", 1.5)
        .dielectric("inner", inner)
        .sphere([0.0; 3], 1.0, "outer")
        .sphere([0.0; 3], 1.0 - gap, "inner")
        .sphere([0.0, 2.0, -4.0], 3.0, "lamp")
        .load()
}

fn mean_of(film: &Film) -> f64 {
    let all = means(film);
    all.iter().sum::<f64>() / all.len() as f64
}

/// The same for white glass, in which every path comes to `expected` in the end: those that the bounce limit has cut,
/// which are known by their number, lack just that, and no others do. Where balls of glass overlap two of a million
/// are still in there after 4000 bounces, in f64 as well: totally reflected time and again, they find the other ball
/// that they came by only then.
fn deviation_of_white(film: &Film, expected: f64) -> f64 {
    let cut = film.tally().cut_paths;
    let lack = |mean: f64| 1.0 - mean / expected;
    let mut lacks: Vec<f64> = means(film).into_iter().map(lack).collect();
    let all = lacks.iter().sum::<f64>() / 3.0 - cut as f64 / film.samples() as f64;
    // Each is of one pixel.
    lacks.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
    let others = lacks.into_iter().skip(3 * cut as usize);
    let worst = others.fold(all.abs(), |worst, lack| worst.max(lack.abs()));
    // What is no number is the largest deviation of all.
    if all.is_nan() { f64::INFINITY } else { worst }
}

/// So many bounces that hardly a path of glass is cut.
fn white_settings(context: &Context, scene: &Scene) -> Settings {
    Settings {
        max_bounces: 4000,
        ..context.settings(scene, 24, 64)
    }
}

fn nested(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0e-3, "relative");
    let balls = |text: SceneText| {
        text.environment(1.0)
            .dielectric("a", 1.5)
            .dielectric("b", 1.2)
            .dielectric("c", 2.0)
            .sphere([-0.3, 0.0, 0.0], 0.6, "a")
            .sphere([0.3, 0.0, 0.0], 0.6, "b")
            .sphere([0.0, 0.3, 0.0], 0.5, "c")
            .sphere([-0.3, 0.0, 0.0], 0.3, "a")
    };
    let views = [[0.0, 0.0, 4.0], [0.0, 0.1, 0.3], [-0.3, 0.05, 0.0]];
    for (view, media) in views.into_iter().zip([1.0, 4.0, 2.25]) {
        let scene = balls(SceneText::new(view, [0.0, 0.0, -9.0])).load()?;
        let film = context.render(&scene, &white_settings(context, &scene))?;
        // Radiance in glass is larger by the index squared.
        measure.add(
            deviation_of_white(&film, media * context.disturbed(0.01)),
            || format!("white furnace from {view:?}"),
        );
    }
    // A ball of the same index within glass: the mean is that of the plain ball.
    let plain = |inner: bool| {
        let text = SceneText::new([0.0, 0.0, 4.0], [0.0; 3])
            .diffuse("lamp", 0.0, 1.0)
            .dielectric("glass", 1.5)
            .dielectric("same", 1.5 * context.disturbed(0.2))
            .sphere([0.0; 3], 1.0, "glass")
            .sphere([0.0, 5.0, -4.0], 4.0, "lamp");
        let text = if inner {
            text.sphere([0.2, 0.0, 0.0], 0.6, "same")
        } else {
            text
        };
        text.load()
    };
    let (with, without) = (plain(true)?, plain(false)?);
    let settings = context.settings(&with, 24, context.size(1024, 8192));
    let (a, b) = (
        context.render(&with, &settings)?,
        context.render(&without, &settings)?,
    );
    let (z, bias) = difference(&a, &b);
    // The two are independent: 3.9 deviations, in the unit of this measure.
    measure.add(1.0e-3 * z.abs() / 3.9, || {
        format!("same index inside: {z:.2} deviations, bias {bias:.2e}")
    });
    Ok(measure)
}

/// z and relative bias of the difference of the means of two independent films.
fn difference(a: &Film, b: &Film) -> (f64, f64) {
    let variance = |film: &Film| -> f64 {
        let pixels = 0..film.rect().pixels();
        let all = pixels.filter_map(|i| film.variance_of_mean(i));
        // The channels have the same paths: their deviations add.
        all.map(|v| v.iter().map(|v| v.sqrt()).sum::<f64>().powi(2))
            .sum()
    };
    let count = (3 * a.rect().pixels()) as f64;
    let error = (variance(a) + variance(b)).sqrt() / count;
    let bias = mean_of(a) - mean_of(b);
    (bias / error, bias / mean_of(b))
}

fn refused(context: &Context) -> Result<Measure> {
    let good = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 36.0\n[image]\n\
                width = 16\nheight = 16\n[material.m]\ntype = \"mirror\"\nreflectance = [1, 1, 1]\n\
                [[sphere]]\ncenter = [0, 0, 0]\nradius = 1.0\nmaterial = \"m\"\n";
    let mut measure = Measure::new(0.0, "accepted");
    let bad = [
        ("radius = 1.0", "radius = 0.0"),
        ("radius = 1.0", "radius = -1.0"),
        ("radius = 1.0", "radius = nan"),
        ("radius = 1.0", "radius = inf"),
        ("radius = 1.0", "radius = 1.1e20"),
        ("center = [0, 0, 0]", "center = [nan, 0, 0]"),
        ("center = [0, 0, 0]", "center = [0, -inf, 0]"),
        ("position = [0, 0, 4]", "position = [0, nan, 4]"),
        ("look_at = [0, 0, 0]", "look_at = [0, 0, 4]"),
        ("fov = 36.0", "fov = 180.0"),
        ("reflectance = [1, 1, 1]", "reflectance = [1.5, 1, 1]"),
    ];
    for (old, new) in bad {
        // The disturbance is a scene that is right.
        let new = if context.options.disturb { old } else { new };
        let text = good.replace(old, new);
        let line = 1 + text[..text.find(new).unwrap_or(0)].matches('\n').count();
        let said = load_str("bad.toml", &text)
            .map(|_| ())
            .map_err(|e| e.to_string());
        let named = said
            .as_ref()
            .is_err_and(|e| e.contains(&format!("bad.toml:{line}:")));
        measure.count(1, u64::from(!named), || format!("{new}: {said:?}"));
    }
    Ok(measure)
}
