//! Some frames of a trajectory, one after the other.

use std::path::Path;

use super::builtin;
use super::direct::Movie;
use super::load::Loaded;
use super::particles::look::Look;
use crate::error::{Error, Result};
use crate::particles::Format;

/// Which frames: those from `first` on, each `step`-th, before `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    /// The first; 0 is the file's first.
    pub first: u64,
    /// One past the last; `None`: as many as there are.
    pub end: Option<u64>,
    /// From one to the next; at least 1.
    pub step: u64,
}

impl Frames {
    /// Those among so many.
    fn of(self, there: u64) -> Result<Vec<u64>> {
        let end = self.end.unwrap_or(there);
        let last = self.end.map_or(self.first, |end| end.saturating_sub(1));
        if last >= there {
            return Err(Error::Usage(format!(
                "--frames: there is no frame {last}: the trajectory has {there}, and the first is 0"
            )));
        }
        let step = usize::try_from(self.step).unwrap_or(usize::MAX);
        Ok((self.first..end).step_by(step).collect())
    }
}

/// Frames of a scene with particle files.
#[derive(Debug)]
pub struct Trajectory {
    frames: Vec<u64>,
    source: Source,
}

#[derive(Debug)]
enum Source {
    /// A particle file without a scene file.
    Movie(Box<Movie>),
    /// A scene file, as it was typed.
    Scene(Option<String>),
}

impl Trajectory {
    /// The frames of the scene that a command line's `SCENE` means. Of a particle file without a scene file all
    /// are looked at, so that they are seen from one place; of a scene file those files have frames that name none
    /// and hold more than one.
    ///
    /// # Errors
    /// [`Error::Usage`] if there are no such frames; what loading the scene says.
    pub fn open(argument: Option<&str>, look: &Look, frames: Frames) -> Result<Self> {
        let particles = argument
            .map(Path::new)
            .filter(|path| Format::of_path(path).is_some());
        if let Some(path) = particles {
            let (movie, frames) = Movie::open(path, look, |there| frames.of(there))?;
            let source = Source::Movie(Box::new(movie));
            return Ok(Self { frames, source });
        }
        let loaded = builtin::resolve_as(argument, look, Some(frames.first))?;
        let Some(there) = loaded.frames else {
            return Err(Error::Usage(format!(
                "--frames: no particle file of {} has more than one frame and leaves open which",
                loaded.name
            )));
        };
        Ok(Self {
            frames: frames.of(there)?,
            source: Source::Scene(argument.map(String::from)),
        })
    }

    /// Their numbers; at least one.
    #[must_use]
    pub fn frames(&self) -> &[u64] {
        &self.frames
    }

    /// The scene of a frame.
    ///
    /// # Errors
    /// What loading the scene says.
    pub fn load(&self, frame: u64) -> Result<Loaded> {
        match &self.source {
            Source::Movie(movie) => movie.load(frame),
            Source::Scene(argument) => {
                builtin::resolve_as(argument.as_deref(), &Look::default(), Some(frame))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_from_the_first_to_before_the_end() {
        let of = |first, end, step, there| Frames { first, end, step }.of(there);
        assert_eq!(of(0, None, 1, 3).expect("all"), [0, 1, 2]);
        assert_eq!(of(1, None, 2, 6).expect("odd ones"), [1, 3, 5]);
        assert_eq!(of(2, Some(6), 3, 6).expect("two"), [2, 5]);
        assert_eq!(of(2, Some(3), u64::MAX, 6).expect("one"), [2]);
        for (first, end) in [(3, None), (0, Some(4)), (7, Some(9))] {
            let error = of(first, end, 1, 3).expect_err("no such frame");
            assert!(error.to_string().contains("has 3"), "{error}");
        }
    }
}
