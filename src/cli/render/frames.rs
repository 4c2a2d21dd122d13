//! `render --frames`: an image for each frame of a trajectory.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::display::Series;
use super::request;
use super::session::Session;
use crate::cli::args::RenderArgs;
use crate::error::{Error, Result};
use crate::output::{Target, check_all};
use crate::scene::trajectory::{Frames, Trajectory};

/// Renders the frames, one after the other.
pub(super) fn run(args: &RenderArgs, frames: Frames) -> Result<()> {
    let first_begin = Instant::now();
    if args.checkpoint.is_some() {
        return Err(Error::Usage(
            "--checkpoint keeps one render, and --frames are several: each is written when it is done, and \
             --frames goes on from the next"
                .into(),
        ));
    }
    // Before the files are read, which may take its time.
    let names = Names::of(args)?;
    let trajectory = Trajectory::open(args.scene.as_deref(), &args.look(), frames)?;
    let all = trajectory.frames();
    let digits = all.last().map_or(1, |last| last.to_string().len());
    let mut session = None;
    for (done, frame) in all.iter().enumerate() {
        let begin = Instant::now();
        let loaded = trajectory.load(*frame)?;
        let args = names.at(args, &loaded.name, *frame, digits)?;
        if done == 0 {
            check_last(&names.at(&args, &loaded.name, all[all.len() - 1], digits)?)?;
        }
        let request = request(&args, loaded)?;
        let session = match &session {
            Some(session) => session,
            // With the first that is known to be one.
            None => session.insert(Session::open(&args)?),
        };
        session
            .progress
            .part(&format!("frame {frame} ({}/{})", done + 1, all.len()));
        let series = Series {
            done,
            all: all.len(),
            first_begin,
            begin,
        };
        let ended = session.perform(&args, &request, series);
        if session.signals.code().is_some() {
            session.progress.message(&format!(
                "{done} of {} frames are complete; --frames {} goes on",
                all.len(),
                rest(frames, *frame)
            ));
        }
        ended?;
    }
    Ok(())
}

/// The frames from `first` on, as they are typed.
fn rest(frames: Frames, first: u64) -> String {
    let end = frames.end.map_or_else(String::new, |end| end.to_string());
    match frames.step {
        1 => format!("{first}..{end}"),
        step => format!("{first}..{end}..{step}"),
    }
}

/// That the outputs of the last frame can be written too.
fn check_last(args: &RenderArgs) -> Result<()> {
    let mut outputs: Vec<&Path> = args.output.iter().map(PathBuf::as_path).collect();
    outputs.extend(args.stats.as_deref());
    outputs.extend(args.dump_wgsl.as_deref());
    check_all(&outputs, &[])
}

/// Names of outputs with the frame's number left open.
struct Names {
    output: Vec<Name>,
    stats: Option<Name>,
    dump_wgsl: Option<Name>,
}

impl Names {
    fn of(args: &RenderArgs) -> Result<Self> {
        let of = |path: &PathBuf| Name::parse(path);
        let output: Vec<Name> = args.output.iter().map(of).collect::<Result<_>>()?;
        for name in &output {
            // For its ending.
            Target::parse(name.at(0))?;
        }
        Ok(Self {
            output,
            stats: args.stats.as_ref().map(of).transpose()?,
            dump_wgsl: args.dump_wgsl.as_ref().map(of).transpose()?,
        })
    }

    /// The options with the outputs of a frame; of the scene's name where none was typed, the number with so many
    /// `digits`.
    fn at(&self, args: &RenderArgs, scene: &str, frame: u64, digits: usize) -> Result<RenderArgs> {
        let output = match self.output.is_empty() {
            true => vec![format!("{scene}-{frame:0digits$}.png").into()],
            false => self.output.iter().map(|name| name.at(frame)).collect(),
        };
        Ok(RenderArgs {
            output,
            stats: self.stats.as_ref().map(|name| name.at(frame)),
            dump_wgsl: self.dump_wgsl.as_ref().map(|name| name.at(frame)),
            frames: None,
            ..args.clone()
        })
    }
}

/// A path with `{frame}` in it, or `{frame:04}` for a number of at least four digits.
struct Name {
    /// Text, and the digits of the number behind it.
    parts: Vec<(String, usize)>,
    end: String,
}

impl Name {
    fn parse(path: &Path) -> Result<Self> {
        let wrong = |what: &str| {
            Error::Usage(format!(
                "the output '{}' {what}: with --frames it needs {{frame}}, as in movie-{{frame}}.png, or \
                 {{frame:04}} for four digits",
                path.display()
            ))
        };
        let text = path.to_str().ok_or_else(|| wrong("is no Unicode text"))?;
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once("{frame") {
            let (form, after) = after
                .split_once('}')
                .ok_or_else(|| wrong("has a { without a }"))?;
            let digits = match form {
                "" => Some(1),
                _ => form
                    .strip_prefix(":0")
                    .and_then(|digits| digits.parse().ok())
                    .filter(|digits| (1..=20).contains(digits)),
            };
            let digits = digits.ok_or_else(|| wrong("has an unknown form of the number"))?;
            parts.push((before.to_owned(), digits));
            rest = after;
        }
        if parts.is_empty() {
            return Err(wrong("would be that of every frame"));
        }
        Ok(Self {
            parts,
            end: rest.to_owned(),
        })
    }

    fn at(&self, frame: u64) -> PathBuf {
        let mut text = String::new();
        for (before, digits) in &self.parts {
            text += before;
            text += &format!("{frame:0digits$}");
        }
        (text + &self.end).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_the_number() {
        let at = |text: &str| Name::parse(Path::new(text)).map(|name| name.at(7));
        let named = |text: &str| at(text).map(|path| path.display().to_string());
        assert_eq!(named("a-{frame}.png").expect("plain"), "a-7.png");
        assert_eq!(
            named("{frame}/b{frame:03}.exr").expect("twice"),
            "7/b007.exr"
        );
        for wrong in [
            "a.png",
            "{frame.png",
            "{frame:3}.png",
            "{frame:00}.png",
            "{frames}.png",
        ] {
            let error = at(wrong).expect_err(wrong).to_string();
            assert!(
                error.contains(wrong) && error.contains("{frame:04}"),
                "{error}"
            );
        }
    }

    #[test]
    fn what_is_left_is_typed_as_it_is_read() {
        let read = |text: &str| crate::cli::values::frames(text).expect(text);
        for text in ["3..", "3..9", "3..9..2", "3....2"] {
            assert_eq!(rest(read(text), 3), text);
        }
    }
}
