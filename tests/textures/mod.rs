//! Textures: lookups against their f64 twins and by hand, materials with them, images with them, files of them.

mod files;
mod images;
mod lookups;
mod materials;

use std::sync::Arc;

use glam::DVec3;
use gpu_trace::image::Picture;
use gpu_trace::materials::texturable::texturable_key;
use gpu_trace::materials::{Texturable, Texture, TextureImage};
use gpu_trace::verify::Random;

/// The albedo of diffuse surfaces.
fn albedo() -> &'static Texturable {
    texturable_key("diffuse", "albedo").expect("it may be a texture")
}

/// What any surface emits.
fn emission() -> &'static Texturable {
    texturable_key("diffuse", "emission").expect("it may be a texture")
}

/// An image for a colour.
fn image(picture: Picture, axis: DVec3) -> Texture {
    Texture::Image(TextureImage::new("image", Arc::new(picture), false, axis))
}

/// An image of values from 0 to 1.
fn random_picture(width: u32, height: u32, name: &str) -> Picture {
    let mut random = Random::new(name);
    let texels = (0..width * height).map(|_| [0; 3].map(|_| random.unit() as f32));
    Picture::new(width, height, texels.collect())
}
