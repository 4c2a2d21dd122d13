//! Twin of `shaders/light/projected.wesl`.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::aim::Aim;
use crate::sampling::directions::basis_around;

/// Area of the segment of the unit disc with half angle h, for p = (cos h, sin h), h in [0, pi].
#[must_use]
pub fn segment_area(p: DVec2) -> f64 {
    let q = p.y * p.y;
    if p.x > 0.0 && q < 0.25 {
        // The series of the integral of 2 s^2 (1 - s^2)^(-1/2) ds.
        let mut term = 2.0;
        let mut sum = 0.0;
        for k in 0..30 {
            let k = f64::from(k);
            sum += term / (2.0 * k + 3.0);
            term *= q * (2.0 * k + 1.0) / (2.0 * k + 2.0);
        }
        p.y * q * sum
    } else {
        p.y.atan2(p.x) - p.x * p.y
    }
}

/// (cos h, sin h) of the segment with this area, in [0, pi].
#[must_use]
pub fn segment_point(area: f64) -> DVec2 {
    let least = area.min(PI - area).max(1.0e-90);
    // From below; the next is from above, and the rest falls.
    let mut h = (1.5 * least).cbrt();
    for _ in 0..20 {
        let step = (segment_area(DVec2::from_angle(h)) - least) / (2.0 * h.sin().powi(2));
        h -= step;
        if step.abs() <= 1.0e-16 * h {
            break;
        }
    }
    let p = DVec2::from_angle(h);
    DVec2::new(if area > 0.5 * PI { -p.x } else { p.x }, p.y)
}

/// A light as a vertex with a normal sees it; see the kernel's struct.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct Cap {
    pub aim: Aim,
    pub cosine: f64,
    pub horizon: DVec2,
    pub segment: f64,
    pub ellipse: f64,
    pub area: f64,
}

/// The cap of a light. The area is 0 if nothing of it is above the horizon, or if the vertex is not
/// outside.
#[must_use]
pub fn cap_seen(aim: &Aim, normal: DVec3) -> Cap {
    let (c, s, rim) = (normal.dot(aim.axis), aim.sine, aim.rim);
    let tilt = aim.axis - c * normal;
    let meet = if rim < s {
        tilt.length_squared() - rim * rim
    } else {
        (s - c) * (s + c)
    };
    let across = meet.max(0.0);
    let horizon = DVec2::new(rim, across.sqrt()) / (across + rim * rim).max(1.0e-300).sqrt();
    let (segment, ellipse) = if c > 0.0 && meet <= 0.0 {
        (0.0, PI)
    } else {
        let meeting = DVec2::new(-c * horizon.x, horizon.y) / s;
        (segment_area(horizon), segment_area(meeting))
    };
    let area = (segment + s * s * c * ellipse).max(1.0e-6 * segment);
    let seen = (c > 0.0 || meet > 0.0) && aim.outside;
    Cap {
        aim: *aim,
        cosine: c,
        horizon,
        segment,
        ellipse,
        area: if seen { area } else { 0.0 },
    }
}

/// A direction to the part of a cap above the horizon, and the extent: pdf = cos/extent in solid
/// angle. The area must be positive.
#[must_use]
pub fn sample_cap(cap: &Cap, normal: DVec3, u: DVec2) -> (DVec3, f64) {
    let (s, c) = (cap.aim.sine, cap.cosine);
    let share = if cap.segment <= 0.0 {
        1.0
    } else if c > 0.0 {
        s * s * c * cap.ellipse / cap.area
    } else {
        0.0
    };
    let basis = basis_around(normal);
    let flat = cap.aim.axis - c * normal;
    let tilt = DVec2::new(flat.dot(basis.tangent), flat.dot(basis.bitangent));
    let along = tilt.try_normalize().unwrap_or(DVec2::X);
    let sin_t = tilt.length();
    let g = sin_t * cap.aim.rim;
    let (local, extent) = if u.x < share {
        let p = segment_point(u.x / share * cap.ellipse);
        let y = (2.0 * u.y - 1.0) * p.y;
        let lift =
            c * c + 2.0 * g * s * c * p.x + s * s * (1.0 - c * c - c * c * p.x * p.x - y * y);
        let local = DVec3::new(g - s * c * p.x, s * y, lift.max(0.0).sqrt());
        (local, cap.area)
    } else {
        let p = segment_point((1.0 - u.x) / (1.0 - share) * cap.segment);
        let y = (2.0 * u.y - 1.0) * p.y;
        let x_r = ((1.0 - y) * (1.0 + y)).sqrt();
        let kept = if c < 0.0 {
            let gap = (cap.horizon.y - y) * (cap.horizon.y + y);
            let q = ((s - y) * (s + y)).max(0.0).sqrt() / s;
            let stretch = sin_t / (s * (q - c * cap.horizon.x / s).max(1.0e-300));
            stretch * stretch * gap * (x_r + cap.horizon.x) / (x_r + g - s * c * q)
        } else {
            1.0
        };
        let step = kept * (p.y - y) * (p.y + y) / (x_r + p.x);
        let local = DVec3::new(x_r - step, y, (step * (2.0 * x_r - step)).max(0.0).sqrt());
        let whole = if c < 0.0 { cap.segment } else { cap.area };
        (local, kept * whole)
    };
    let tangent = along.x * basis.tangent + along.y * basis.bitangent;
    let bitangent = along.x * basis.bitangent - along.y * basis.tangent;
    (
        local.x * tangent + local.y * bitangent + local.z * normal,
        extent,
    )
}
