//! What images are compared by.

use std::io;
use std::path::Path;

use crate::film::Film;
use crate::image::Picture;
use crate::output::metadata::Metadata;
use crate::output::{npy, png};

/// The means of all pixels and channels, rows from the top.
#[must_use]
pub fn means(film: &Film) -> Vec<f64> {
    (0..film.rect().pixels())
        .flat_map(|i| film.mean(i))
        .collect()
}

/// The bits of the image that a film gives.
#[must_use]
pub fn image_bits(film: &Film) -> Vec<u32> {
    let pixels = film.pixels();
    pixels.as_flattened().iter().map(|x| x.to_bits()).collect()
}

/// Share of the values of `film` that are off from the reference's by more than 0.1 %.
#[must_use]
pub fn share_off(film: &Film, reference: &Film) -> f64 {
    let (a, b) = (means(film), means(reference));
    let near = |(x, y): &(&f64, &f64)| (*x - *y).abs() <= 1.0e-3 * y.abs();
    1.0 - a.iter().zip(&b).filter(near).count() as f64 / a.len() as f64
}

/// The image that a film gives.
#[must_use]
pub fn picture_of(film: &Film) -> Picture {
    let rect = film.rect();
    Picture::new(rect.width, rect.height, film.pixels())
}

/// Leaves two images and their difference in `folder`, as NAME.of.npy and as pictures, and says so: for the
/// message of a test that fails.
#[must_use]
pub fn leave_images(folder: &Path, name: &str, found: &Picture, wanted: &Picture) -> String {
    let name: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    match write_images(folder, &name, found, wanted) {
        Ok(()) => format!("the images are {}/{name}.*", folder.display()),
        Err(e) => format!("the images cannot be left in {}: {e}", folder.display()),
    }
}

fn write_images(folder: &Path, name: &str, found: &Picture, wanted: &Picture) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let (a, b) = (found.pixels.clone(), wanted.pixels.clone());
    let apart = |(x, y): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| x[c] - y[c]);
    let difference: Vec<[f32; 3]> = a.iter().zip(&b).map(apart).collect();
    // A picture shows its size alone, ten times as large.
    let size = difference
        .iter()
        .map(|d| d.map(|x| 10.0 * x.abs()))
        .collect();
    let picture = |pixels: Vec<[f32; 3]>| Picture::new(found.width, found.height, pixels);
    let of = |what: &str, ending: &str| folder.join(format!("{name}.{what}.{ending}"));
    for (what, pixels, shown) in [
        ("found", a.clone(), a),
        ("wanted", b.clone(), b),
        ("difference", difference, size),
    ] {
        std::fs::write(of(what, "npy"), npy::encode(&picture(pixels)))?;
        let shown = png::encode(&picture(shown), 0.0, &Metadata::new())?;
        std::fs::write(of(what, "png"), shown)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;
    use crate::verify::{render_in_f64, settings};

    #[test]
    fn images_are_left_and_can_be_read() {
        let scene = builtin::resolve(None).expect("the gallery").scene;
        let film = |spp| render_in_f64(&scene, &settings(&scene, 4, 3, spp)).expect("a film");
        let (one, two) = (picture_of(&film(1)), picture_of(&film(2)));
        let folder = tempfile::tempdir().expect("a folder");
        let said = leave_images(folder.path(), "a name, 1/2", &one, &two);
        assert!(said.ends_with("a-name--1-2.*"), "{said}");
        let read = |what: &str| {
            let file = folder.path().join(format!("a-name--1-2.{what}.npy"));
            crate::input::read(&file).expect("an image").picture.pixels
        };
        assert_eq!(read("found"), one.pixels);
        assert_eq!(read("wanted"), two.pixels);
        let [a, b] = [&one, &two].map(|picture| picture.pixels[0][1]);
        assert_eq!(read("difference")[0][1], a - b);
        // And where there is no folder, it is said.
        let file = folder.path().join("file");
        std::fs::write(&file, "").expect("a file");
        let said = leave_images(&file, "x", &one, &two);
        assert!(said.contains("cannot be left"), "{said}");
    }
}
