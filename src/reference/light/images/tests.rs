use super::*;
use crate::statistics::chi_square;
use crate::verify::Random;

/// What a ray from the vertex finds, traced in space without any of the formulas above: by how much it misses the lamp's
/// centre in the lamp's radii, negative numbers if that is behind it; `None` if it does not go this way.
fn traced(sight: &Sight, direction: DVec3) -> Option<f64> {
    let from = -sight.distance * sight.axis;
    let b = -from.dot(direction);
    let square = b * b - from.length_squared() + 1.0;
    if b <= 0.0 || square < 0.0 {
        return None;
    }
    let refract = |d: DVec3, n: DVec3, eta: f64| {
        let cosine = -d.dot(n);
        let square = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
        (square > 0.0).then(|| (d / eta + (cosine / eta - square.sqrt()) * n).normalize())
    };
    let mut at = from + (b - square.sqrt()) * direction;
    let mut way = direction - 2.0 * direction.dot(at) * at;
    if sight.way == Way::Through {
        let ior = sight.ior.expect("glass");
        let within = refract(direction, at, ior)?;
        at -= 2.0 * at.dot(within) * within;
        way = refract(within, -at, 1.0 / ior)?;
    }
    let lamp = sight.along * sight.axis + sight.across * sight.sideways - at;
    let near = lamp.dot(way);
    let missed = (lamp - near * way).length() / sight.radius;
    Some(if near > 0.0 { missed } else { -missed })
}

/// Lamps and vertices near to a sphere and far from it, small and large, ahead, beside and behind.
fn sights(random: &mut Random, count: usize) -> Vec<Sight> {
    let make = |i| {
        let axis = random.direction();
        let radius = random.magnitude(-1.5, 0.7);
        let rho = (1.0 + radius) * (1.0 + random.magnitude(-2.0, 1.0));
        let beta = match i % 8 {
            0 => 0.0,
            1 => PI,
            _ => random.range(0.0, PI),
        };
        let way = [Way::Reflected, Way::Through][i % 2];
        let ior: Option<f64> =
            [None, Some(1.5), Some(1.5), Some(2.4), Some(0.7), Some(1.05)][i % 6];
        Sight {
            axis,
            distance: 1.0 + random.magnitude(-2.0, 1.5),
            sideways: basis_around(axis).tangent,
            along: rho * f64::cos(beta),
            across: rho * f64::sin(beta).abs(),
            radius,
            way: if ior.is_none() { Way::Reflected } else { way },
            ior,
        }
    };
    (0..count).map(make).collect()
}

/// The direction with this square of its impact parameter, at this angle about the axis.
fn direction(sight: &Sight, u: f64, phi: f64) -> DVec3 {
    let sine = u.sqrt() / sight.distance;
    let across = phi.cos() * sight.sideways + phi.sin() * sight.axis.cross(sight.sideways);
    (1.0 - sine * sine).sqrt() * sight.axis + sine * across
}

/// How many of some directions the arcs say something else of than rays that are traced, and how many meet the lamp;
/// `scale`: of the arcs.
fn arcs_off(scale: f64) -> (usize, usize) {
    let mut random = Random::new("arcs");
    let (mut off, mut met) = (0, 0);
    for sight in sights(&mut random, 2000) {
        for _ in 0..50 {
            let (u, phi) = (random.unit(), random.range(-PI, PI));
            let ring = sight.ring(u);
            let said =
                phi.abs() < scale * ring.halves[0] || (PI - phi.abs()) < scale * ring.halves[1];
            let found = traced(&sight, direction(&sight, u, phi));
            // At the limb rounding may have it.
            if found.is_some_and(|missed| (missed.abs() - 1.0).abs() < 1.0e-6) {
                continue;
            }
            let is_met = found.is_some_and(|missed| (0.0..1.0).contains(&missed));
            // What is reflected totally within a bubble goes no way through it, and weighs nothing.
            let none = found.is_none() && ring.share <= 0.0;
            off += usize::from(is_met != said && !none);
            met += usize::from(is_met);
        }
    }
    (off, met)
}

#[test]
fn arcs_are_what_rays_find() {
    let (off, met) = arcs_off(1.0);
    assert!(off == 0 && met > 2000, "{off} of {met}");
    // A companion: arcs a thousandth too wide.
    let (off, _) = arcs_off(1.001);
    assert!(off > 0);
}

/// The integral of the pdf over all directions that meet the lamp, by rays on a grid over the sphere's disc, and the
/// share of drawn directions that do, with its standard error.
fn integrals(sight: &Sight, scale: f64) -> [f64; 3] {
    const SIDE: usize = 400;
    let mut integral = 0.0;
    for i in 0..SIDE {
        for j in 0..SIDE {
            let u = (i as f64 + 0.5) / SIDE as f64;
            let phi = (j as f64 + 0.5) / SIDE as f64 * 2.0 * PI;
            let way = direction(sight, u, phi);
            let met = traced(sight, way).is_some_and(|missed| (0.0..1.0).contains(&missed));
            if met {
                // du dphi over this is the solid angle.
                let factor = 2.0 * sight.distance.powi(2) * sight.axis.dot(way);
                integral += scale * sight.pdf(way).0 / factor;
            }
        }
    }
    integral *= 2.0 * PI / (SIDE * SIDE) as f64;
    let mut random = Random::new("drawn");
    const DRAWN: usize = 20_000;
    let drawn = (0..DRAWN).filter(|_| {
        let [x, y, ..] = random.unit4().map(f64::from);
        sight.sample([x, y]).is_some()
    });
    let share = drawn.count() as f64 / DRAWN as f64;
    let error = (share * (1.0 - share) / DRAWN as f64).sqrt();
    [integral, share, error]
}

/// Sights that a grid shows.
fn plain_sights() -> Vec<Sight> {
    let mut random = Random::new("plain");
    let mut all = sights(&mut random, 300);
    all.retain(|s| s.radius > 0.3 && s.distance > 1.1 && s.bins().iter().sum::<f64>() > 0.02);
    assert!(all.len() > 20, "{}", all.len());
    all.truncate(20);
    all
}

#[test]
fn the_pdf_is_that_of_what_is_drawn() {
    let off = |scale: f64| {
        let all = plain_sights();
        let off = all.iter().filter(|sight| {
            let [integral, share, error] = integrals(sight, scale);
            // Of the grid: its cells at the lamp's limb.
            (integral - share).abs() > 4.0 * error + 0.01
        });
        off.count()
    };
    assert_eq!(off(1.0), 0);
    // A companion: a pdf a twentieth too large.
    assert!(off(1.05) > 10);
}

/// The chi-square test of drawn directions against the pdf, over cells of u and phi; the pdf of one half is `scale` too large.
fn p_value(sight: &Sight, scale: f64) -> f64 {
    const SIDE: usize = 16;
    const FINE: usize = 1000;
    let mut random = Random::new("chi-square");
    let mut counts = vec![0u64; SIDE * SIDE + 1];
    for _ in 0..40_000 {
        let [x, y, ..] = random.unit4().map(f64::from);
        let Some(s) = sight.sample([x, y]) else {
            counts[SIDE * SIDE] += 1;
            continue;
        };
        let cosine = sight.axis.dot(s.wi);
        let u = (1.0 - cosine * cosine) * sight.distance.powi(2);
        let way = s.wi - cosine * sight.axis;
        let phi = way
            .dot(sight.axis.cross(sight.sideways))
            .atan2(way.dot(sight.sideways))
            + PI;
        let cell = |x: f64| ((x * SIDE as f64) as usize).min(SIDE - 1);
        counts[SIDE * cell(u) + cell(phi / (2.0 * PI))] += 1;
        // And both say the same of it, but next to the end of a bin.
        let ratio = sight.pdf(s.wi).0 / s.pdf;
        let near = (0..=BINS).any(|i| (u - end(i)).abs() < 1.0e-9);
        assert!(near || (ratio - 1.0).abs() < 1.0e-5, "{ratio} at {u}");
    }
    let mut wanted = vec![0.0; SIDE * SIDE + 1];
    for i in 0..SIDE * FINE {
        let u = (i as f64 + 0.5) / (SIDE * FINE) as f64;
        // Exact along phi: the pdf is the same on all of the arcs.
        let ring = sight.ring(u);
        let (width, [near, far]) = (ring.width(), ring.halves);
        let on_arcs = direction(sight, u, if near > 0.0 { 0.0 } else { PI });
        let factor = 2.0 * sight.distance.powi(2) * sight.axis.dot(on_arcs);
        let pdf = sight.pdf(on_arcs).0 / factor;
        if width <= 0.0 {
            continue;
        }
        for j in 0..SIDE {
            let step = 2.0 * PI / SIDE as f64;
            let low = j as f64 * step - PI;
            let overlap = |from: f64, to: f64| (to.min(low + step) - from.max(low)).max(0.0);
            let covered = overlap(-near, near) + overlap(-PI, far - PI) + overlap(PI - far, PI);
            let scale = if i < SIDE * FINE / 2 { scale } else { 1.0 };
            wanted[SIDE * (i / FINE) + j] += scale * pdf * covered / (SIDE * FINE) as f64;
        }
    }
    let sum: f64 = wanted.iter().sum();
    wanted[SIDE * SIDE] = (1.0 - sum).max(0.0);
    let total: f64 = wanted.iter().sum();
    wanted.iter_mut().for_each(|p| *p /= total);
    chi_square(&counts, &wanted).p
}

#[test]
fn directions_are_drawn_with_their_pdf() {
    let all = plain_sights();
    let least = crate::statistics::sidak(all.len());
    let ps = |scale| all.iter().map(|s| p_value(s, scale)).collect::<Vec<_>>();
    let found = ps(1.0);
    assert!(found.iter().all(|p| *p > least), "{found:?}");
    // A companion: the half near the axis a tenth more likely.
    let low = ps(1.1).into_iter().filter(|p| *p < least).count();
    assert!(low > all.len() / 3, "{low}");
}
