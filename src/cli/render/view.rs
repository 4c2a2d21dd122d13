//! Images of something else than light (`--view`).

use crate::cli::format::significant;
use crate::compare::HeatMap;
use crate::error::Result;
use crate::image::{Format, Picture};
use crate::output::{Contents, Target, write_all};
use crate::settings::View;

/// Writes the numbers to those of the targets that hold numbers, and to PNG their colours.
///
/// # Errors
/// Those of [`write_all`].
pub(super) fn write(view: View, targets: &[Target], contents: &Contents<'_>) -> Result<()> {
    let (seen, held): (Vec<Target>, Vec<Target>) = targets
        .iter()
        .cloned()
        .partition(|target| target.format == Format::Png);
    let heat = heat(contents.picture);
    let metadata = contents
        .metadata
        .clone()
        .with("shows", view.name())
        .with("black", 0.0)
        .with("pale_yellow", heat.range)
        .with("beyond", heat.beyond);
    let colours = Contents {
        picture: &heat.picture(),
        metadata: &metadata,
        exposure: 0.0,
        ..*contents
    };
    let numbers = contents.metadata.clone().with("shows", view.name());
    let numbers = Contents {
        metadata: &numbers,
        ..*contents
    };
    // Each is worth having without the other.
    let written = write_all(&held, &numbers);
    write_all(&seen, &colours)?;
    written
}

/// What the line at the end says of it.
pub(super) fn summary(view: View, picture: &Picture) -> String {
    let numbers = || picture.pixels.iter().map(|pixel| f64::from(pixel[0]));
    let mean = numbers().sum::<f64>() / picture.pixels.len() as f64;
    let most = numbers().fold(0.0, f64::max);
    let View::BvhCost = view;
    format!(
        "{} steps through the tree a sample, {} in the dearest pixel (pale yellow: {})",
        significant(mean),
        significant(most),
        significant(heat(picture).range)
    )
}

fn heat(picture: &Picture) -> HeatMap {
    let numbers = picture.pixels.iter().map(|pixel| f64::from(pixel[0]));
    HeatMap::new(picture.width, numbers.collect())
}
