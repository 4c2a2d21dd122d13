//! Values of materials that depend on where on a sphere a point is.

use std::f64::consts::PI;
use std::fmt;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::Texturable;
use super::schema::along;
use crate::image::Picture;

/// A texture, for the value of a key. Numbers are grey.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// A cubic lattice about the sphere's centre: the first value where floor(x/size) + floor(y/size) + floor(z/size)
    /// is even for the offset (x, y, z) from there, else the second.
    Checker {
        /// Both values.
        values: [DVec3; 2],
        /// Of a cell, in scene units.
        size: f64,
    },
    /// Between two values by 1/2 + sum 2^-o g(2^o x/size)/(2 sum 2^-o), g being a gradient noise of the offset x.
    Noise {
        /// Both values.
        values: [DVec3; 2],
        /// Of the coarsest cells, in scene units.
        size: f64,
        /// How many noises are summed.
        octaves: u32,
    },
    /// An image about an axis.
    Image(TextureImage),
}

/// An image on a sphere, by the outward normal: row 0 is at the axis.
#[derive(Clone, PartialEq)]
pub struct TextureImage {
    name: String,
    image: Arc<Picture>,
    number: bool,
    axis: DVec3,
    least: DVec3,
    largest: DVec3,
    mean: DVec3,
}

/// A key whose value is a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Textured {
    /// The key.
    pub key: &'static Texturable,
    /// Its value.
    pub texture: Texture,
}

impl TextureImage {
    /// An image about `axis`, not 0, for a key that is a `number`, which reads the red channel, or a colour.
    /// `name` is what messages call it.
    #[must_use]
    pub fn new(name: &str, image: Arc<Picture>, number: bool, axis: DVec3) -> Self {
        let value = |texel: &[f32; 3]| {
            let value = DVec3::from_array(texel.map(f64::from));
            match number {
                true => DVec3::splat(value.x),
                false => value,
            }
        };
        let values = || image.pixels.iter().map(value);
        let (width, height) = (image.width as usize, f64::from(image.height));
        let edge = |row: usize| (PI * row as f64 / height).cos();
        let rows = image.pixels.chunks(width).enumerate();
        // Each texel as if its value were the same all over.
        let sums = rows.map(|(row, texels)| {
            let sum: DVec3 = texels.iter().map(value).sum();
            0.5 * (edge(row) - edge(row + 1)) * sum
        });
        Self {
            name: name.to_owned(),
            number,
            axis: along(axis),
            least: values().fold(DVec3::INFINITY, DVec3::min),
            largest: values().fold(DVec3::NEG_INFINITY, DVec3::max),
            mean: sums.sum::<DVec3>() / width as f64,
            image,
        }
    }

    /// What messages call it: its file, as the scene names it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The image, row 0 at the axis.
    #[must_use]
    pub fn image(&self) -> &Arc<Picture> {
        &self.image
    }

    /// Whether all its values are finite.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        // Nothing that is not leaves the mean.
        self.mean.is_finite()
    }

    /// The unit vector at which row 0 is.
    #[must_use]
    pub fn axis(&self) -> DVec3 {
        self.axis
    }

    /// The value at the centre of a texel.
    #[must_use]
    pub fn texel(&self, column: u32, row: u32) -> DVec3 {
        let place = row as usize * self.image.width as usize + column as usize;
        let value = DVec3::from_array(self.image.pixels[place].map(f64::from));
        match self.number {
            true => DVec3::splat(value.x),
            false => value,
        }
    }

    /// The shortest rotation that takes the axis to +y; of -y half a turn about +x.
    #[must_use]
    pub fn rotation(&self) -> DMat3 {
        let across = self.axis.cross(DVec3::Y);
        let sine = across.length();
        let size = across.abs().max_element();
        // Its square may be no f64.
        let Some(k) = (across / size).try_normalize() else {
            return DMat3::from_diagonal(match self.axis.y > 0.0 {
                true => DVec3::ONE,
                false => DVec3::new(1.0, -1.0, -1.0),
            });
        };
        // Rodrigues: c I + s [k] + (1 - c) k k^T.
        let cross = DMat3::from_cols(
            DVec3::new(0.0, k.z, -k.y),
            DVec3::new(-k.z, 0.0, k.x),
            DVec3::new(k.y, -k.x, 0.0),
        );
        let along = DMat3::from_cols(k.x * k, k.y * k, k.z * k);
        self.axis.y * DMat3::IDENTITY + sine * cross + (1.0 - self.axis.y) * along
    }
}

impl fmt::Debug for TextureImage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Without its texels, which may be millions.
        formatter
            .debug_struct("TextureImage")
            .field("name", &self.name)
            .field("size", &[self.image.width, self.image.height])
            .field("axis", &self.axis)
            .finish_non_exhaustive()
    }
}

impl Texture {
    /// The least value of each channel.
    #[must_use]
    pub fn least(&self) -> DVec3 {
        match self {
            Self::Checker { values, .. } | Self::Noise { values, .. } => values[0].min(values[1]),
            Self::Image(image) => image.least,
        }
    }

    /// The largest value of each channel.
    #[must_use]
    pub fn largest(&self) -> DVec3 {
        match self {
            Self::Checker { values, .. } | Self::Noise { values, .. } => values[0].max(values[1]),
            Self::Image(image) => image.largest,
        }
    }

    /// The mean over a sphere: of a checker exactly, since the mirror image of its cells is the other ones; of a noise
    /// that over all spheres.
    #[must_use]
    pub fn mean(&self) -> DVec3 {
        match self {
            Self::Checker { values, .. } | Self::Noise { values, .. } => {
                0.5 * (values[0] + values[1])
            }
            Self::Image(image) => image.mean,
        }
    }

    /// Values among which are those at which a material that rises or falls with each channel is extreme: both of a
    /// checker; of a noise also one in between; of an image the corners of the box of all texels, and its middle.
    #[must_use]
    pub fn extremes(&self) -> Vec<DVec3> {
        match self {
            Self::Checker { values, .. } => values.to_vec(),
            Self::Noise { values: [a, b], .. } => vec![*a, *b, 0.5 * (*a + *b)],
            Self::Image(image) => {
                let (least, largest) = (self.least(), self.largest());
                let middle = 0.5 * (least + largest);
                if image.number {
                    return vec![least, largest, middle];
                }
                let corner = |i: u32| {
                    let at = |bit: u32, channel: usize| match i >> bit & 1 {
                        0 => least[channel],
                        _ => largest[channel],
                    };
                    DVec3::new(at(0, 0), at(1, 1), at(2, 2))
                };
                (0..8).map(corner).chain([middle]).collect()
            }
        }
    }
}
