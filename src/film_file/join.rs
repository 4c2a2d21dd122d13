//! Parts of an image become one: in the order of their sample indices, whatever order they come in.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::{About, FilmFile, read, read_about};
use crate::error::{Error, Result};
use crate::film::next_look;
use crate::render::StoppedBy;

/// Parts of one image, none of whose sums has been read yet: these take memory for two films, however many
/// parts there are.
#[derive(Clone, Debug)]
pub struct Parts {
    /// By their first samples, and at least one.
    parts: Vec<Part>,
    /// The runs of samples that are in, with those that touch as one.
    ranges: Vec<[u64; 2]>,
}

#[derive(Clone, Debug)]
struct Part {
    path: PathBuf,
    about: About,
}

impl Parts {
    /// Those in film files, in any order.
    ///
    /// # Errors
    /// [`Error::Usage`] where parts are of other scenes or settings, have samples in common, or, unless
    /// `allow_gaps`, have samples between them that nobody has; and without any part. Those of [`read_about`].
    pub fn of(paths: &[PathBuf], allow_gaps: bool) -> Result<Self> {
        let part = |path: &PathBuf| {
            let about = read_about(path)?;
            let path = path.clone();
            Ok(Part { path, about })
        };
        let mut parts = paths.iter().map(part).collect::<Result<Vec<_>>>()?;
        // Sums in f64 depend on the order: this one is always the same. No two parts begin at one sample.
        parts.sort_by_key(|part| part.about.ranges.first().copied());
        check_same(&parts)?;
        let ranges = ranges(&parts)?;
        if !allow_gaps && let [[_, from], [to, _], ..] = ranges[..] {
            let text = gap_text(&parts, from, to);
            return Err(Error::Usage(format!("{text}; or --allow-gaps")));
        }
        Ok(Self { parts, ranges })
    }

    /// What the part with the first samples says, and where it is.
    #[must_use]
    pub fn first(&self) -> (&About, &Path) {
        let Part { path, about } = &self.parts[0];
        (about, path)
    }

    /// That the parts have just these samples.
    ///
    /// # Errors
    /// [`Error::Usage`] with those that are missing, or too many.
    pub fn check_samples(&self, samples: &Range<u64>) -> Result<()> {
        let (first, last) = (self.ranges[0][0], self.ranges[self.ranges.len() - 1][1]);
        if first > samples.start {
            return Err(Error::Usage(gap_text(&self.parts, samples.start, first)));
        }
        if last < samples.end {
            return Err(Error::Usage(gap_text(&self.parts, last, samples.end)));
        }
        if (first..last) == *samples {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "the parts have the samples {first}..{last}, more than {}..{}",
            samples.start, samples.end
        )))
    }

    /// The image of all, one part after the other. Their makers may differ, and are all kept; the rest that
    /// is no sum is that of the part with the first samples.
    ///
    /// # Errors
    /// Those of [`read`], and [`Error::Usage`] if the parts do not fit together after all.
    pub fn join(self) -> Result<FilmFile> {
        let (first, others) = self.parts.split_first().ok_or_else(none)?;
        let FilmFile {
            mut about,
            mut film,
        } = first.read()?;
        for part in others {
            let more = part.read()?;
            if film.allocation() != more.film.allocation() {
                return Err(Error::Usage(format!(
                    "{} and {} have their samples in other tiles: --adaptive has no parts",
                    first.path.display(),
                    part.path.display()
                )));
            }
            film.join(&more.film);
            for maker in more.about.makers {
                if !about.makers.contains(&maker) {
                    about.makers.push(maker);
                }
            }
            about.seconds += more.about.seconds;
        }
        about.counts = film.counts();
        about.samples = about.counts.samples();
        if let (Some(first), Some(last)) = (self.ranges.first(), self.ranges.last())
            && !others.is_empty()
        {
            about.goal.samples = [first[0], last[1]];
            about.look = next_look(film.samples());
            about.stopped_by = Some(StoppedBy::Spp);
            (about.goal.error, about.goal.time) = (None, None);
        }
        about.ranges = self.ranges;
        Ok(FilmFile { about, film })
    }
}

impl Part {
    fn read(&self) -> Result<FilmFile> {
        let file = read(&self.path)?;
        if file.about == self.about {
            return Ok(file);
        }
        Err(Error::Usage(format!(
            "{} has been written anew just now: a render of it goes on",
            self.path.display()
        )))
    }
}

fn none() -> Error {
    Error::Usage("no part to merge".into())
}

/// Refuses parts of several images.
fn check_same(parts: &[Part]) -> Result<()> {
    let (first, others) = parts.split_first().ok_or_else(none)?;
    for other in others {
        let (a, b) = (&first.about, &other.about);
        let names = format!("{} and {}", first.path.display(), other.path.display());
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
    }
    Ok(())
}

/// The runs of samples that are in, with those that touch as one.
fn ranges(parts: &[Part]) -> Result<Vec<[u64; 2]>> {
    let mut all: Vec<([u64; 2], &Path)> = Vec::new();
    for Part { path, about } in parts {
        if about.ranges.is_empty() {
            let name = path.display();
            return Err(Error::Usage(format!(
                "{name} has no samples yet: gpu-trace resume {name}"
            )));
        }
        all.extend(about.ranges.iter().map(|range| (*range, path.as_path())));
    }
    all.sort_by_key(|(range, _)| *range);
    let mut joined: Vec<[u64; 2]> = Vec::new();
    let mut before = Path::new("");
    for ([start, end], path) in all {
        match joined.last_mut() {
            Some(last) if start < last[1] => {
                return Err(Error::Usage(format!(
                    "{} and {} both have the samples {start}..{}: leave one of them out, or render it with \
                     another --sample-range",
                    before.display(),
                    path.display(),
                    last[1].min(end)
                )));
            }
            Some(last) if start == last[1] => last[1] = end,
            _ => joined.push([start, end]),
        }
        before = path;
    }
    Ok(joined)
}

/// What to say of samples that no part has.
fn gap_text(parts: &[Part], from: u64, to: u64) -> String {
    let unfinished = parts.iter().find(|part| {
        let end = part.about.ranges.last().map(|range| range[1]);
        end == Some(from) && part.about.goal.samples[1] > from
    });
    let help = match unfinished.map(|part| part.path.display()) {
        Some(name) => format!("{name} is not finished: gpu-trace resume {name}"),
        None => format!("render them with --sample-range {from}..{to}"),
    };
    format!("no part has the samples {from}..{to}: {help}")
}
