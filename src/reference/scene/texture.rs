//! Twin of `shaders/scene/texture.wesl`, the integers bit for bit.

use std::borrow::Cow;
use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::materials::lattice::LatticePoint;
use crate::materials::material::parameter;
use crate::materials::mix::Weight;
use crate::materials::texturable::EMISSION;
use crate::materials::{Material, MaterialKind, Texture, TextureImage};
use crate::sampling::random::mix_bits;

/// Where on its sphere a point is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturePoint {
    /// From the centre, in scene units.
    pub offset: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
}

/// The value of a texture at a point.
#[must_use]
pub fn texture_value(texture: &Texture, point: &TexturePoint) -> DVec3 {
    let lattice = |size: f64| LatticePoint::of(point.offset, 1.0 / size);
    match texture {
        Texture::Checker { values, size } => {
            let [x, y, z] = lattice(*size).cell;
            values[(x.wrapping_add(y).wrapping_add(z) & 1) as usize]
        }
        Texture::Noise {
            values: [a, b],
            size,
            octaves,
        } => a.lerp(*b, noise(&lattice(*size), *octaves)),
        Texture::Image(image) => image_value(image, image_place(image, point.normal)),
    }
}

/// 1/2 + sum 2^-o g(2^o x)/(2 sum 2^-o)
#[must_use]
pub fn noise(point: &LatticePoint, octaves: u32) -> f64 {
    let (mut sum, mut total, mut weight) = (0.0, 0.0, 1.0);
    for octave in 0..octaves {
        let x = f64::from(1u32 << octave) * point.place;
        let whole = x.floor();
        let cells = whole.to_array().map(|x| x as u32);
        let cell = std::array::from_fn(|k| (point.cell[k] << octave).wrapping_add(cells[k]));
        sum += weight * gradient_noise(cell, x - whole);
        total += weight;
        weight *= 0.5;
    }
    0.5 + 0.5 * sum / total
}

/// Perlin's, of magnitude up to 1; see the kernel.
#[must_use]
pub fn gradient_noise(cell: [u32; 3], place: DVec3) -> f64 {
    let corner = |i: u32| {
        let step = [i & 1, i >> 1 & 1, i >> 2];
        let [x, y, z] = std::array::from_fn(|k| cell[k].wrapping_add(step[k]));
        let bits = mix_bits(mix_bits(x, y), z);
        slope(bits, place - DVec3::from(step.map(f64::from)))
    };
    let weight = place * place * place * (place * (6.0 * place - 15.0) + 10.0);
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    let line = |i: u32| mix(corner(i), corner(i + 1), weight.x);
    let plane = |i: u32| mix(line(i), line(i + 2), weight.y);
    (2.0f64 / 3.0).sqrt() * mix(plane(0), plane(4), weight.z)
}

fn slope(bits: u32, d: DVec3) -> f64 {
    let which = bits >> 28;
    let u = if which < 8 { d.x } else { d.y };
    let v = match which {
        0..4 => d.y,
        12 | 14 => d.x,
        _ => d.z,
    };
    let signed = |x: f64, bit: u32| if which & bit != 0 { -x } else { x };
    signed(u, 1) + signed(v, 2)
}

/// Where in the image the outward normal is, in texels from its upper left corner.
#[must_use]
pub fn image_place(image: &TextureImage, normal: DVec3) -> DVec2 {
    let w = image.rotation() * normal;
    let across = w.x.atan2(-w.z) / TAU;
    let down = 2.0 * w.x.hypot(w.z).atan2(w.y) / TAU;
    let picture = image.image();
    let size = DVec2::new(picture.width.into(), picture.height.into());
    DVec2::new(across - across.floor(), down) * size
}

/// The value there: bilinear between the centres of texels; columns go on around, rows end.
#[must_use]
pub fn image_value(image: &TextureImage, place: DVec2) -> DVec3 {
    let [width, height] = [image.image().width, image.image().height].map(i64::from);
    let low = (place - 0.5).floor();
    let part = place - 0.5 - low;
    let texel = |x: i64, y: i64| {
        let (column, row) = (x.rem_euclid(width), y.clamp(0, height - 1));
        image.texel(column as u32, row as u32)
    };
    let (x, y) = (low.x as i64, low.y as i64);
    let row = |y: i64| texel(x, y).lerp(texel(x + 1, y), part.x);
    row(y).lerp(row(y + 1), part.y)
}

/// How a material scatters light at a point.
#[must_use]
pub fn kind_at<'a>(material: &'a Material, point: &TexturePoint) -> Cow<'a, MaterialKind> {
    let scattering = material.textures.iter().filter(|t| t.key.key != EMISSION);
    let values = scattering.map(|t| parameter(t.key, texture_value(&t.texture, point)));
    let values: Vec<_> = values.collect();
    let kind = match values[..] {
        [] => Cow::Borrowed(&material.kind),
        _ => Cow::Owned(material.kind.with(&values)),
    };
    match &*kind {
        MaterialKind::Mix(mix) => {
            let mut mix = mix.clone();
            for part in &mut mix.parts {
                part.material.kind = kind_at(&part.material, point).into_owned();
                part.material.textures.clear();
                for factor in &mut part.inner {
                    if let Weight::Texture(texture) = &factor.weight {
                        factor.weight = Weight::Number(texture_value(texture, point).x);
                    }
                }
            }
            Cow::Owned(mix.into())
        }
        _ => kind,
    }
}

/// What it emits there.
#[must_use]
pub fn emission_at(material: &Material, point: &TexturePoint) -> DVec3 {
    let texture = material.texture(EMISSION);
    texture.map_or(material.emission, |texture| texture_value(texture, point))
}
