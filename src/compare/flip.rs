//! FLIP, the difference that is seen when two images alternate: Andersson, Nilsson, Akenine-Möller,
//! Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM
//! Comput. Graph. Interact. Tech. 3(2), 2020. This is LDR-FLIP; sections are those of the paper.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::Seen;
use super::filter::{kernel, separable};

/// Of an observer 0.7 m from a 4K screen 0.7 m wide, as in the paper. The authors' code does not
/// round and takes 67.0206, which changes FLIP by some 1e-4 of itself.
pub const DEFAULT_PPD: f64 = 67.0;

/// The exponent of the HyAB distance, section 4.1.3.
const QC: f64 = 0.7;
/// Below this share of the largest distance ...
const PC: f64 = 0.4;
/// ... lie errors up to this.
const PT: f64 = 0.95;
/// The width of an edge in degrees, section 4.2.
const FEATURE_WIDTH: f64 = 0.082;
/// The exponent of feature differences.
const QF: f64 = 0.5;

/// The sensitivity of an opponent channel to contrast: a1, b1, a2, b2 of table 1, for the sum of two
/// Gaussians a sqrt(π/b) exp(-π² x²/b), x in degrees.
const SENSITIVITY: [[f64; 4]; 3] = [
    [1.0, 0.0047, 0.0, 1.0e-5],
    [1.0, 0.0053, 0.0, 1.0e-5],
    [34.1, 0.04, 13.5, 0.025],
];

/// The FLIP error of each pixel, 0 to 1.
///
/// # Panics
/// If the images have different sizes.
#[must_use]
pub fn flip(image: &Seen, reference: &Seen, pixels_per_degree: f64) -> Vec<f64> {
    assert_eq!(image.pixels.len(), reference.pixels.len(), "the sizes");
    let colours = [image, reference].map(|seen| perceived(seen, pixels_per_degree));
    let features = [image, reference].map(|seen| features(seen, pixels_per_degree));
    let largest = hyab(hunt(DVec3::Y), hunt(DVec3::Z)).powf(QC);
    (0..image.pixels.len())
        .map(|i| {
            let colour = hyab(colours[0][i], colours[1][i]).powf(QC);
            let [a, b] = [features[0][i], features[1][i]];
            let feature = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
            let feature = (feature / 2f64.sqrt()).powf(QF);
            redistribute(colour, largest).powf(1.0 - feature)
        })
        .collect()
}

/// Spreads the distances over 0..=1, most of it for the small ones (section 4.1.3).
fn redistribute(distance: f64, largest: f64) -> f64 {
    let knee = PC * largest;
    if distance < knee {
        PT / knee * distance
    } else {
        PT + (distance - knee) / (largest - knee) * (1.0 - PT)
    }
}

/// Filters by what the eye can resolve, and goes to Hunt-adjusted L*a*b* (sections 4.1.1, 4.1.2).
fn perceived(seen: &Seen, ppd: f64) -> Vec<DVec3> {
    // Three standard deviations of the widest Gaussian.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as usize;
    let channel = |c: usize| {
        let plane: Vec<f64> = seen
            .pixels
            .iter()
            .map(|p| opponent(xyz(DVec3::from_array(*p)))[c])
            .collect();
        let [a1, b1, a2, b2] = SENSITIVITY[c];
        let mut filtered = vec![0.0; plane.len()];
        let mut total = 0.0;
        for (a, b) in [(a1, b1), (a2, b2)].into_iter().filter(|(a, _)| *a > 0.0) {
            let weight = a * (PI / b).sqrt();
            let gauss = kernel(radius, |x| (-PI * PI / b * (x / ppd).powi(2)).exp());
            total += weight * gauss.iter().sum::<f64>().powi(2);
            let part = separable(&plane, seen.width, &gauss, &gauss);
            for (sum, value) in filtered.iter_mut().zip(part) {
                *sum += weight * value;
            }
        }
        filtered.iter().map(|v| v / total).collect::<Vec<f64>>()
    };
    let planes = [0, 1, 2].map(channel);
    let to_rgb = rgb_to_xyz().inverse();
    (0..seen.pixels.len())
        .map(|i| {
            let filtered = DVec3::from_array([0, 1, 2].map(|c| planes[c][i]));
            let rgb = to_rgb * from_opponent(filtered);
            hunt(rgb.clamp(DVec3::ZERO, DVec3::ONE))
        })
        .collect()
}

/// The magnitudes of edges and of points about each pixel (section 4.2).
fn features(seen: &Seen, ppd: f64) -> Vec<[f64; 2]> {
    let plane: Vec<f64> = seen
        .pixels
        .iter()
        .map(|p| (opponent(xyz(DVec3::from_array(*p))).x + 16.0) / 116.0)
        .collect();
    let sigma = 0.5 * FEATURE_WIDTH * ppd;
    let radius = (3.0 * sigma).ceil() as usize;
    let gauss = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let smooth = normalised(kernel(radius, gauss));
    let edge = normalised(kernel(radius, |x| -x * gauss(x)));
    let point = normalised(kernel(radius, |x| ((x / sigma).powi(2) - 1.0) * gauss(x)));
    let magnitudes = |detector: &[f64]| -> Vec<f64> {
        let across = separable(&plane, seen.width, detector, &smooth);
        let down = separable(&plane, seen.width, &smooth, detector);
        across.iter().zip(down).map(|(a, b)| a.hypot(b)).collect()
    };
    let (edges, points) = (magnitudes(&edge), magnitudes(&point));
    edges.iter().zip(points).map(|(e, p)| [*e, p]).collect()
}

/// Scales the positive weights to a sum of 1 and the negative ones to -1.
fn normalised(mut weights: Vec<f64>) -> Vec<f64> {
    let positive: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = -weights.iter().filter(|w| **w < 0.0).sum::<f64>();
    for weight in &mut weights {
        *weight /= if *weight > 0.0 {
            positive
        } else {
            negative.max(f64::MIN_POSITIVE)
        };
    }
    weights
}

/// From linear RGB (sRGB's primaries, D65) to XYZ. The fractions are those of the authors' code.
fn rgb_to_xyz() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(
            10_135_552.0 / 24_577_794.0,
            2_613_072.0 / 12_288_897.0,
            1_425_312.0 / 73_733_382.0,
        ),
        DVec3::new(
            8_788_810.0 / 24_577_794.0,
            8_788_810.0 / 12_288_897.0,
            8_788_810.0 / 73_733_382.0,
        ),
        DVec3::new(
            4_435_075.0 / 24_577_794.0,
            887_015.0 / 12_288_897.0,
            70_074_185.0 / 73_733_382.0,
        ),
    )
}

/// XYZ relative to white.
fn xyz(rgb: DVec3) -> DVec3 {
    rgb_to_xyz() * rgb
}

fn white() -> DVec3 {
    xyz(DVec3::ONE)
}

/// YCxCz, a linear form of L*a*b*.
fn opponent(xyz: DVec3) -> DVec3 {
    let v = xyz / white();
    DVec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
}

fn from_opponent(v: DVec3) -> DVec3 {
    let y = (v.x + 16.0) / 116.0;
    DVec3::new(y + v.y / 500.0, y, y - v.z / 200.0) * white()
}

/// L*a*b* of linear RGB with a* and b* scaled by luminance, after Hunt: colours look stronger in
/// brighter light.
fn hunt(rgb: DVec3) -> DVec3 {
    let delta = 6.0 / 29.0;
    let curve = |t: f64| {
        if t > delta * delta * delta {
            t.cbrt()
        } else {
            t / (3.0 * delta * delta) + 4.0 / 29.0
        }
    };
    let v = xyz(rgb) / white();
    let [x, y, z] = v.to_array().map(curve);
    let lightness = 116.0 * y - 16.0;
    DVec3::new(
        lightness,
        0.01 * lightness * 500.0 * (x - y),
        0.01 * lightness * 200.0 * (y - z),
    )
}

/// A distance for large differences of colour: Abasi et al. 2020.
fn hyab(a: DVec3, b: DVec3) -> f64 {
    (a.x - b.x).abs() + (a.y - b.y).hypot(a.z - b.z)
}
