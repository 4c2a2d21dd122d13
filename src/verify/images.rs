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
    share_beyond(film, reference, 1.0e-3)
}

/// Share of the values of `film` that are off from the reference's by more than `tolerance`, relative to these.
#[must_use]
pub fn share_beyond(film: &Film, reference: &Film, tolerance: f64) -> f64 {
    let (a, b) = (means(film), means(reference));
    let near = |(x, y): &(&f64, &f64)| (*x - *y).abs() <= tolerance * y.abs();
    1.0 - a.iter().zip(&b).filter(near).count() as f64 / a.len() as f64
}

/// The image that a film gives.
#[must_use]
pub fn picture_of(film: &Film) -> Picture {
    let rect = film.rect();
    Picture::new(rect.width, rect.height, film.pixels())
}

/// Leaves an image in `folder`, as NAME.found.npy and as a picture, and says so: for the message of a test that fails.
/// With what was wanted instead, and with their difference where that has the same size.
#[must_use]
pub fn leave_images(
    folder: &Path,
    name: &str,
    found: &Picture,
    wanted: Option<&Picture>,
) -> String {
    let name: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    match write_images(folder, &name, found, wanted) {
        Ok(()) => format!("the images are {}/{name}.*", folder.display()),
        Err(e) => format!("the images cannot be left in {}: {e}", folder.display()),
    }
}

fn write_images(
    folder: &Path,
    name: &str,
    found: &Picture,
    wanted: Option<&Picture>,
) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let write = |what: &str, picture: &Picture, shown: &Picture| {
        let of = |ending: &str| folder.join(format!("{name}.{what}.{ending}"));
        std::fs::write(of("npy"), npy::encode(picture))?;
        std::fs::write(of("png"), png::encode(shown, 0.0, &Metadata::new())?)
    };
    write("found", found, found)?;
    let Some(wanted) = wanted else {
        return Ok(());
    };
    write("wanted", wanted, wanted)?;
    if (found.width, found.height) != (wanted.width, wanted.height) {
        return Ok(());
    }
    let pairs = found.pixels.iter().zip(&wanted.pixels);
    let apart = pairs.map(|(x, y)| [0, 1, 2].map(|c| x[c] - y[c]));
    let difference = Picture::new(found.width, found.height, apart.collect());
    // A picture shows its size alone, ten times as large.
    let mut size = difference.clone();
    for x in size.pixels.as_flattened_mut() {
        *x = 10.0 * x.abs();
    }
    write("difference", &difference, &size)
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
        let said = leave_images(folder.path(), "a name, 1/2", &one, Some(&two));
        assert!(said.ends_with("a-name--1-2.*"), "{said}");
        let read = |what: &str| {
            let file = folder.path().join(format!("a-name--1-2.{what}.npy"));
            crate::input::read(&file).expect("an image").picture.pixels
        };
        assert_eq!(read("found"), one.pixels);
        assert_eq!(read("wanted"), two.pixels);
        let [a, b] = [&one, &two].map(|picture| picture.pixels[0][1]);
        assert_eq!(read("difference")[0][1], a - b);
        // One alone, and of two sizes; where there is no folder, it is said.
        let names = |prefix: &str| {
            let files = std::fs::read_dir(folder.path()).expect("the folder");
            let names = files.map(|file| file.expect("a file").file_name());
            let names = names.filter_map(|name| name.into_string().ok());
            names.filter(|name| name.starts_with(prefix)).count()
        };
        let _ = leave_images(folder.path(), "alone", &one, None);
        assert_eq!(names("alone."), 2);
        let wider = picture_of(&render_in_f64(&scene, &settings(&scene, 5, 3, 1)).expect("a film"));
        let _ = leave_images(folder.path(), "sizes", &one, Some(&wider));
        assert_eq!(names("sizes."), 4);
        let file = folder.path().join("file");
        std::fs::write(&file, "").expect("a file");
        let said = leave_images(&file, "x", &one, None);
        assert!(said.contains("cannot be left"), "{said}");
    }
}
