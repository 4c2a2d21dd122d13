//! Comparisons of images, and what they are compared by. One that fails leaves both images.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use gpu_trace::film::Film;
use gpu_trace::image::Picture;
use gpu_trace::settings::Rect;
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{leave_images, means, picture_of};

/// What can be seen.
pub(crate) trait Image {
    fn picture(&self) -> Picture;
}

impl Image for Film {
    fn picture(&self) -> Picture {
        picture_of(self)
    }
}

impl Image for Picture {
    fn picture(&self) -> Picture {
        self.clone()
    }
}

/// Where images are left.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("target/test-images")
}

/// The images of a comparison: a test that fails while it holds this leaves them, and says where.
#[must_use = "it leaves nothing once it is dropped"]
pub(crate) struct Left {
    name: String,
    found: Picture,
    wanted: Option<Picture>,
}

impl Left {
    /// What was found and what was wanted.
    pub(crate) fn of(name: impl Display, found: &impl Image, wanted: &impl Image) -> Self {
        let mut left = Self::alone(name, found);
        left.wanted = Some(wanted.picture());
        left
    }

    /// What was found, where no image was wanted but a number.
    pub(crate) fn alone(name: impl Display, found: &impl Image) -> Self {
        Self {
            name: name.to_string(),
            found: found.picture(),
            wanted: None,
        }
    }
}

impl Drop for Left {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let (found, wanted) = (&self.found, self.wanted.as_ref());
            eprintln!("{}", leave_images(&folder(), &self.name, found, wanted));
        }
    }
}

/// What is wrong with an image that should be like a reference; `None` where it `holds`, else with both left.
pub(crate) fn fault(
    name: &str,
    found: &impl Image,
    wanted: &impl Image,
    holds: bool,
    what: impl Display,
) -> Option<String> {
    let left = || leave_images(&folder(), name, &found.picture(), Some(&wanted.picture()));
    (!holds).then(|| format!("{name}: {what}; {}", left()))
}

/// Fails unless it `holds` that an image is like a reference.
#[track_caller]
pub(crate) fn assert_alike(
    name: &str,
    found: &impl Image,
    wanted: &impl Image,
    holds: bool,
    what: impl Display,
) {
    if let Some(fault) = fault(name, found, wanted, holds, what) {
        panic!("{fault}");
    }
}

/// Fails unless two images are the same to the bit.
#[track_caller]
pub(crate) fn assert_same(name: impl Display, found: &impl Image, wanted: &impl Image) {
    let (found, wanted) = (found.picture(), wanted.picture());
    let bits = |picture: &Picture| -> Vec<u32> {
        let values = picture.pixels.as_flattened().iter();
        values.map(|x| x.to_bits()).collect()
    };
    let size = |picture: &Picture| (picture.width, picture.height);
    let same = size(&found) == size(&wanted) && bits(&found) == bits(&wanted);
    assert_alike(&name.to_string(), &found, &wanted, same, "other bits");
}

/// An image of the size of a film with these values.
pub(crate) fn with_values(film: &Film, values: impl IntoIterator<Item = [f64; 3]>) -> Picture {
    let pixels = values.into_iter().map(|value| value.map(|x| x as f32));
    Picture::new(film.rect().width, film.rect().height, pixels.collect())
}

/// An image of the size of a film that is this value everywhere.
pub(crate) fn uniform(film: &Film, value: [f64; 3]) -> Picture {
    with_values(film, vec![value; film.rect().pixels()])
}

/// The light of a class: the mean of films that have it as a layer.
pub(crate) fn class_image(films: &[Film], class: usize) -> Picture {
    let value = |i: usize| {
        films.iter().fold([0.0; 3], |mean, film| {
            let light = film.aovs(i).expect("asked for").classes[class];
            let samples = films.len() as f64 * film.samples() as f64;
            [0, 1, 2].map(|c| mean[c] + light[c] / samples)
        })
    };
    with_values(&films[0], (0..films[0].rect().pixels()).map(value))
}

/// A part of an image.
pub(crate) fn cut(whole: &impl Image, part: Rect) -> Picture {
    let whole = whole.picture();
    let rows = whole.pixels.chunks(whole.width as usize);
    let rows = rows.skip(part.y as usize).take(part.height as usize);
    let (from, to) = (part.x as usize, (part.x + part.width) as usize);
    let pixels = rows.flat_map(|row| &row[from..to]).copied();
    Picture::new(part.width, part.height, pixels.collect())
}

/// Fails unless it `holds` that a film is this value everywhere.
#[track_caller]
pub(crate) fn assert_uniform(name: &str, film: &Film, value: f64, holds: bool, what: impl Display) {
    assert_alike(name, film, &uniform(film, [value; 3]), holds, what);
}

/// The mean of some values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of each channel of an image and its standard error, the pixels being independent.
pub(crate) fn channels(film: &Film) -> [[f64; 2]; 3] {
    assert_eq!(film.tally().non_finite, 0);
    let pixels = film.rect().pixels();
    std::array::from_fn(|c| {
        let variance = |i| film.variance_of_mean(i).expect("16 batches")[c];
        let sum: f64 = (0..pixels).map(|i| film.mean(i)[c]).sum();
        let error: f64 = (0..pixels).map(variance).sum::<f64>().sqrt();
        [sum, error].map(|x| x / pixels as f64)
    })
}

/// The same by the means of batches over the image, whether its pixels are independent or not.
pub(crate) fn channels_by_batches(film: &Film) -> [[f64; 2]; 3] {
    let pixels = film.rect().pixels();
    let variance = film.variance_of_image_mean().expect("16 batches");
    std::array::from_fn(|c| {
        let sum: f64 = (0..pixels).map(|i| film.mean(i)[c]).sum();
        [sum / pixels as f64, variance[c].sqrt()]
    })
}

/// By how many standard errors the mean of an image, times `scale`, is above that of another one whose samples are
/// others, and by what share of it.
pub(crate) fn bias(film: &Film, reference: &Film, scale: f64) -> (f64, f64) {
    let mean = |film: &Film| mean_and_error(&means(film)).0;
    let variance = |film: &Film| -> f64 {
        let pixels = 0..film.rect().pixels();
        // The channels of a pixel go together: their deviations add.
        let all = pixels.map(|i| film.variance_of_mean(i).expect("16 batches"));
        let sum: f64 = all
            .map(|v| v.iter().map(|v| v.sqrt()).sum::<f64>().powi(2))
            .sum();
        sum / (3.0 * film.rect().pixels() as f64).powi(2)
    };
    let (x, y) = (scale * mean(film), mean(reference));
    let error = (variance(film) + variance(reference)).sqrt();
    ((x - y) / error, x / y - 1.0)
}

/// The largest difference of two images' values, over the largest value.
pub(crate) fn largest_difference(film: &Film, reference: &Film) -> f64 {
    let (a, b) = (means(film), means(reference));
    let largest = b.iter().copied().fold(0.0, f64::max);
    let differences = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / largest
}

/// The largest relative difference of two images' values.
pub(crate) fn largest_relative_difference(film: &Film, reference: &Film) -> f64 {
    let pairs = std::iter::zip(means(film), means(reference));
    pairs.map(|(a, b)| (a - b).abs() / b).fold(0.0, f64::max)
}

#[test]
fn companion_what_fails_leaves_its_images() {
    let gray = |value: f32| Picture::new(2, 1, vec![[value; 3]; 2]);
    let (dark, light) = (gray(0.25), gray(0.5));
    let files = |name: &str| {
        let all = ["found", "wanted", "difference"].map(|what| format!("{name}.{what}.npy"));
        all.map(|file| folder().join(file)).map(|file| {
            let picture = gpu_trace::input::read(&file).ok()?.picture;
            std::fs::remove_file(file.with_extension("png")).expect("it is there");
            std::fs::remove_file(file).expect("it is there");
            Some(picture.pixels[1])
        })
    };
    let left = |holds: bool, name: &str| {
        let failed = std::panic::catch_unwind(|| {
            let _left = Left::of(name, &light, &dark);
            assert!(holds, "on purpose");
        });
        (failed.is_err(), files(name))
    };
    let three = [0.5, 0.25, 0.25].map(|x| Some([x; 3]));
    assert_eq!(left(false, "held-and-failed"), (true, three));
    assert_eq!(left(true, "held-and-passed"), (false, [None; 3]));
    // What fails elsewhere, or later, is no matter of theirs.
    let later = std::panic::catch_unwind(|| {
        drop(Left::alone("dropped", &light));
        panic!("on purpose");
    });
    assert_eq!((later.is_err(), files("dropped")), (true, [None; 3]));
    let same = |name: &str, wanted: &Picture| {
        let failed = std::panic::catch_unwind(|| assert_same(name, &light, wanted));
        (failed.is_err(), files(name))
    };
    assert_eq!(same("other-bits", &dark), (true, three));
    assert_eq!(same("the-same-bits", &light), (false, [None; 3]));
}
