//! Which images a report shows, and what it says of them.

use super::conduct::Outcome;
use super::pictures::{Pair, Shot, align, sample_image};
use super::plan::Study;
use super::report::Gallery;
use super::series::labels;
use super::store::Store;
use super::tables;
use crate::compare::{Errors, HeatMap};
use crate::image::Picture;
use crate::numbers::percent;

/// All of them, in order.
pub(super) fn galleries(
    study: &Study,
    store: &Store,
    outcome: &Outcome,
    pairs: &[Pair],
) -> [Gallery; 3] {
    [
        shown(study, store, outcome),
        equal_time(study, store, outcome),
        precise(store, pairs),
    ]
}

fn shot(label: &str, caption: String, picture: Picture, against: &Picture) -> Shot {
    Shot {
        label: label.into(),
        caption,
        difference: HeatMap::of(&picture, against),
        picture,
    }
}

fn gallery(title: &str, note: &str, mut shots: Vec<Shot>, images: bool) -> Gallery {
    align(&mut shots);
    Gallery {
        title: title.into(),
        note: note.into(),
        shots,
        images,
    }
}

fn shown(study: &Study, store: &Store, outcome: &Outcome) -> Gallery {
    let mut shots = Vec::new();
    let series: Vec<_> = study.subjects.iter().map(|s| s.series).collect();
    for (series, label) in series.iter().zip(labels(&series)) {
        let summary = outcome
            .analysis
            .series
            .iter()
            .find(|s| s.series == series.key());
        for spp in &study.shown {
            let level = summary.and_then(|s| s.levels.iter().find(|l| l.spp == *spp));
            let image = store.image(&sample_image(series, study.seeds.start, *spp));
            let Some((level, picture)) = level.zip(image) else {
                continue;
            };
            let error = level
                .error
                .map_or("error unknown".into(), |e| format!("error {}", percent(e)));
            let caption = format!("{error}, {}", tables::seconds(level.seconds));
            let name = match series_count(study) {
                1 => format!("{spp} samples a pixel"),
                _ => format!("{label}, {spp} samples a pixel"),
            };
            shots.push(shot(&name, caption, picture, &outcome.picture));
        }
    }
    gallery(
        "Images at growing numbers of samples",
        "Each with the map of its relative error against the reference.",
        shots,
        true,
    )
}

fn series_count(study: &Study) -> usize {
    study.subjects.len()
}

fn equal_time(study: &Study, store: &Store, outcome: &Outcome) -> Gallery {
    let series: Vec<_> = study.subjects.iter().map(|s| s.series).collect();
    let names = labels(&series);
    let time = outcome
        .analysis
        .equal_time
        .last()
        .map_or(0.0, |t| t.seconds);
    let shots = outcome.equal_time.iter().filter_map(|(index, spp, name)| {
        let picture = store.image(name)?;
        let difference = Errors::of(&picture, &outcome.picture)?;
        let caption = format!(
            "{spp} spp, {} from the reference",
            percent(difference.relrmse)
        );
        Some(shot(&names[*index], caption, picture, &outcome.picture))
    });
    gallery(
        &format!("Images at equal time: {}", tables::seconds(time)),
        "Setup and compilation included, each with as many samples as fit, and with the map of its relative \
         error against the reference.",
        shots.collect(),
        true,
    )
}

fn precise(store: &Store, pairs: &[Pair]) -> Gallery {
    let shots = pairs.iter().filter_map(|pair| {
        let (image, exact) = pair.last.as_ref()?;
        let (image, exact) = (store.image(image)?, store.image(exact)?);
        let level = pair.levels.last()?;
        let caption = format!("{} spp, {} apart", level.spp, percent(level.relrmse));
        Some(shot(&pair.label, caption, image, &exact))
    });
    gallery(
        "f32 against f64, the same samples",
        "Where the image of a series differs from that of the CPU in f64 without a nudge. Both have the same \
         noise, so that this is precision and the nudge alone.",
        shots.collect(),
        false,
    )
}
