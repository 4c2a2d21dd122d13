//! Parts of an image become one: in the order of their sample indices, whatever order they come in.

use super::{About, FilmFile};
use crate::error::{Error, Result};
use crate::film::next_look;

/// A part, with the name that messages have for it.
#[derive(Clone, Debug)]
pub struct Part {
    /// The file, as it was typed.
    pub name: String,
    /// What is in it.
    pub file: FilmFile,
}

/// Joins parts. What they have of kernels, devices and versions may differ, and is all kept; the rest that is
/// no sum is that of the part with the first samples.
///
/// # Errors
/// [`Error::Usage`] where parts are of other scenes or settings, have samples in common, or, unless
/// `allow_gaps`, have samples between them that nobody has; and without any part.
pub fn join(mut parts: Vec<Part>, allow_gaps: bool) -> Result<FilmFile> {
    // Sums in f64 depend on the order: this one is always the same. No two parts begin at one sample.
    parts.sort_by_key(|part| part.file.about.ranges.first().copied());
    check_same(&parts)?;
    let ranges = ranges(&parts)?;
    if !allow_gaps && let Some(gap) = ranges.windows(2).next() {
        return Err(Error::Usage(gap_text(&parts, gap[0][1], gap[1][0])));
    }
    let mut parts = parts.into_iter().map(|part| part.file);
    let Some(FilmFile {
        mut about,
        mut film,
    }) = parts.next()
    else {
        return Err(Error::Usage("no part to merge".into()));
    };
    let mut joined = false;
    for part in parts {
        film.join(&part.film);
        add(&mut about, part.about);
        joined = true;
    }
    about.ranges = ranges;
    about.counts = film.counts();
    about.samples = about.counts.samples();
    if joined {
        let ends = about.ranges.iter().flatten().copied();
        let (start, end) = (ends.clone().min(), ends.max());
        about.goal.samples = [start.unwrap_or(0), end.unwrap_or(0)];
        about.look = next_look(film.samples());
        about.stopped_by = Some(crate::render::StoppedBy::Spp);
        (about.goal.error, about.goal.time) = (None, None);
    }
    Ok(FilmFile { about, film })
}

/// Takes over what is no sum of pixels.
fn add(about: &mut About, part: About) {
    for kernel in part.kernels {
        if !about.kernels.contains(&kernel) {
            about.kernels.push(kernel);
        }
    }
    for device in part.devices {
        if !about.devices.contains(&device) {
            about.devices.push(device);
        }
    }
    about.seconds += part.seconds;
}

/// Refuses parts of several images.
fn check_same(parts: &[Part]) -> Result<()> {
    let Some((first, others)) = parts.split_first() else {
        return Ok(());
    };
    for other in others {
        let (a, b) = (&first.file.about, &other.file.about);
        let names = format!("{} and {}", first.name, other.name);
        if a.scene.hash != b.scene.hash {
            return Err(Error::Usage(format!(
                "{names} are of different scenes: {} (hash {}) and {} (hash {})",
                a.scene.name, a.scene.hash, b.scene.name, b.scene.hash
            )));
        }
        if let Some([setting, here, there]) = a.settings.differs(&b.settings) {
            return Err(Error::Usage(format!(
                "{names} are of different settings: {setting} is {here} and {there}; render both with one"
            )));
        }
        if first.file.film.allocation() != other.file.film.allocation() {
            return Err(Error::Usage(format!(
                "{names} have their samples in other tiles: --adaptive has no parts"
            )));
        }
    }
    Ok(())
}

/// The runs of samples that are in, with those that touch as one.
fn ranges(parts: &[Part]) -> Result<Vec<[u64; 2]>> {
    let mut all: Vec<([u64; 2], &str)> = Vec::new();
    for part in parts {
        let name = part.name.as_str();
        if part.file.about.ranges.is_empty() {
            return Err(Error::Usage(format!(
                "{name} has no samples yet: gpu-trace resume {name}"
            )));
        }
        all.extend(part.file.about.ranges.iter().map(|range| (*range, name)));
    }
    all.sort_by_key(|(range, _)| *range);
    let mut joined: Vec<[u64; 2]> = Vec::new();
    let mut before = "";
    for ([start, end], name) in all {
        match joined.last_mut() {
            Some(last) if start < last[1] => {
                let both = last[1].min(end);
                return Err(Error::Usage(format!(
                    "{before} and {name} both have the samples {start}..{both}: leave one of them out, or \
                     render it with another --sample-range"
                )));
            }
            Some(last) if start == last[1] => last[1] = end,
            _ => joined.push([start, end]),
        }
        before = name;
    }
    Ok(joined)
}

/// What to say of samples that no part has.
fn gap_text(parts: &[Part], from: u64, to: u64) -> String {
    let unfinished = parts.iter().find(|part| {
        let about = &part.file.about;
        let end = about.ranges.last().map(|range| range[1]);
        end == Some(from) && about.goal.samples[1] > from
    });
    let help = match unfinished {
        Some(Part { name, .. }) => format!("{name} is not finished: gpu-trace resume {name}"),
        None => format!("render them with --sample-range {from}..{to}"),
    };
    format!("no part has the samples {from}..{to}: {help}; or --allow-gaps")
}
