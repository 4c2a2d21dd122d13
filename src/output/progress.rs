//! Progress and messages on stderr: a bar for people, lines for logs, JSON for programs.

use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressMode {
    /// A bar where stderr is a terminal that can draw one, else only messages.
    #[default]
    Auto,
    /// A line every few seconds.
    Plain,
    /// A JSON object a line: `progress` about every second, `message` and `warning` as they come.
    Json,
    /// Only messages.
    None,
}

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Paths traced so far, over all pixels.
    pub samples: u64,
    /// Samples per pixel taken so far.
    pub spp: u64,
    /// Samples per pixel to be taken, where a number was asked for.
    pub spp_total: Option<u64>,
    /// The share of the work that is done, 0 to 1, by whichever stop rule is nearest.
    pub fraction: f64,
    /// Since the start.
    pub elapsed: Duration,
    /// Expected until the end, once that can be told.
    pub remaining: Option<Duration>,
    /// Over the last stretch of the render.
    pub paths_per_second: f64,
    /// The estimated relative error, a fraction, where known.
    pub error: Option<f64>,
}

/// Shows progress. All methods take `&self` and may be called from any thread. Failures to write
/// are ignored: a closed stderr is no reason to lose a render.
#[derive(Debug)]
pub struct Progress {
    quiet: bool,
    state: Mutex<State>,
}

struct State {
    display: Display,
    /// Where lines go, the bar aside.
    stderr: Box<dyn Write + Send>,
    /// The last line shown, for the pause between lines.
    shown: Option<Instant>,
    /// The newest snapshot, until it is shown.
    pending: Option<Snapshot>,
    /// The part of the work that snapshots are of; empty where there is one part.
    part: String,
}

impl std::fmt::Debug for State {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("State")
            .field("display", &self.display)
            .finish_non_exhaustive()
    }
}

#[derive(Debug)]
enum Display {
    Bar(ProgressBar),
    Plain,
    Json,
    None,
}

/// Positions of the bar: finer than any terminal is wide.
const BAR_STEPS: u64 = 1000;

/// Between lines of a log, where hours of rendering should not bury what else is there.
const PLAIN_PAUSE: Duration = Duration::from_secs(5);

/// Between JSON lines: often enough for a display that is made of them.
const JSON_PAUSE: Duration = Duration::from_secs(1);

impl Progress {
    /// Progress on stderr. `quiet` silences the bar and messages; warnings still appear, and so do
    /// the lines of [`ProgressMode::Plain`] and [`ProgressMode::Json`], which were asked for.
    /// Nothing is drawn before the first [`update`](Self::update). No colour is used where
    /// `NO_COLOR` is set and not empty.
    #[must_use]
    pub fn new(mode: ProgressMode, quiet: bool) -> Self {
        let bar = (mode == ProgressMode::Auto && !quiet && io::stderr().is_terminal())
            .then(|| ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr()))
            // Hidden on terminals that cannot move the cursor, and would then swallow messages.
            .filter(|bar| !bar.is_hidden())
            .map(|bar| bar.with_style(bar_style()));
        match bar {
            Some(bar) => Self::with_display(Display::Bar(bar), quiet, Box::new(io::stderr())),
            None => Self::to_writer(mode, quiet, io::stderr()),
        }
    }

    /// As [`new`](Self::new), with lines written elsewhere and no bar.
    #[must_use]
    pub fn to_writer(mode: ProgressMode, quiet: bool, writer: impl Write + Send + 'static) -> Self {
        let display = match mode {
            ProgressMode::Auto | ProgressMode::None => Display::None,
            ProgressMode::Plain => Display::Plain,
            ProgressMode::Json => Display::Json,
        };
        Self::with_display(display, quiet, Box::new(writer))
    }

    fn with_display(display: Display, quiet: bool, stderr: Box<dyn Write + Send>) -> Self {
        // A log needs no line about a render's first moments; a program wants to see it start.
        let shown = matches!(display, Display::Plain).then(Instant::now);
        Self {
            quiet,
            state: Mutex::new(State {
                display,
                stderr,
                shown,
                pending: None,
                part: String::new(),
            }),
        }
    }

    /// Names the part of the work that the following snapshots are of, as in `run 3/24`.
    pub fn part(&self, name: &str) {
        let mut state = self.state();
        state.show_pending();
        name.clone_into(&mut state.part);
    }

    /// Shows how far the render is. May be called as often as there is news: lines are spaced out.
    pub fn update(&self, snapshot: &Snapshot) {
        let mut state = self.state();
        if let Display::Bar(bar) = &state.display {
            if bar.is_finished() {
                bar.reset();
            }
            bar.set_message(labelled(&state.part, snapshot));
            bar.set_position((snapshot.fraction.clamp(0.0, 1.0) * BAR_STEPS as f64) as u64);
            return;
        }
        state.pending = Some(*snapshot);
        let pause = match state.display {
            Display::Json => JSON_PAUSE,
            _ => PLAIN_PAUSE,
        };
        if state.shown.is_none_or(|shown| shown.elapsed() >= pause) {
            state.show_pending();
        }
    }

    /// Tells the user something, above the bar. Silent if `quiet`.
    pub fn message(&self, text: &str) {
        if !self.quiet {
            self.state().line("message", "", text);
        }
    }

    /// Warns the user of something, even if `quiet`.
    pub fn warning(&self, text: &str) {
        self.state().line("warning", "warning: ", text);
    }

    /// Shows the last snapshot if it was not shown yet, and removes the bar. Messages may follow, and snapshots of
    /// another part, with which the bar comes back. Happens by itself when dropped.
    pub fn finish(&self) {
        let mut state = self.state();
        if let Display::Bar(bar) = &state.display {
            bar.finish_and_clear();
        }
        state.show_pending();
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Nothing in here can be left half done in a way that matters.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

impl State {
    fn show_pending(&mut self) {
        let Some(snapshot) = self.pending.take() else {
            return;
        };
        match self.display {
            Display::Json => {
                let part = self.part.clone();
                self.json(&JsonLine::progress(&snapshot, &part));
            }
            Display::Plain => {
                let percent = 100.0 * snapshot.fraction.clamp(0.0, 1.0);
                let text = labelled(&self.part, &snapshot);
                let _ = writeln!(self.stderr, "{percent:3.0} %  {text}");
            }
            Display::Bar(_) | Display::None => return,
        }
        self.shown = Some(Instant::now());
    }

    fn line(&mut self, kind: &'static str, prefix: &str, text: &str) {
        match &self.display {
            Display::Json => self.json(&JsonLine::Text { kind, text }),
            Display::Bar(bar) => {
                let stderr = &mut self.stderr;
                let _ = bar.suspend(|| writeln!(stderr, "{prefix}{text}"));
            }
            Display::Plain | Display::None => {
                let _ = writeln!(self.stderr, "{prefix}{text}");
            }
        }
    }

    fn json(&mut self, line: &JsonLine<'_>) {
        // In one write, so that lines of other processes on the same pipe do not split it.
        if let Ok(mut text) = serde_json::to_string(line) {
            text.push('\n');
            let _ = self.stderr.write_all(text.as_bytes());
        }
    }
}

/// A line of [`ProgressMode::Json`]. Times are in seconds; what is unknown is `null`.
#[derive(Serialize)]
#[serde(untagged)]
enum JsonLine<'a> {
    Progress {
        #[serde(rename = "type")]
        kind: &'static str,
        #[serde(skip_serializing_if = "Option::is_none")]
        part: Option<&'a str>,
        samples: u64,
        spp: u64,
        spp_total: Option<u64>,
        fraction: f64,
        elapsed: f64,
        remaining: Option<f64>,
        paths_per_second: f64,
        error: Option<f64>,
    },
    Text {
        #[serde(rename = "type")]
        kind: &'static str,
        text: &'a str,
    },
}

impl<'a> JsonLine<'a> {
    fn progress(snapshot: &Snapshot, part: &'a str) -> Self {
        Self::Progress {
            kind: "progress",
            part: Some(part).filter(|p| !p.is_empty()),
            samples: snapshot.samples,
            spp: snapshot.spp,
            spp_total: snapshot.spp_total,
            fraction: snapshot.fraction,
            elapsed: snapshot.elapsed.as_secs_f64(),
            remaining: snapshot.remaining.map(|time| time.as_secs_f64()),
            paths_per_second: snapshot.paths_per_second,
            error: snapshot.error,
        }
    }
}

fn labelled(part: &str, snapshot: &Snapshot) -> String {
    match part {
        "" => snapshot.to_string(),
        part => format!("{part}  {snapshot}"),
    }
}

/// As in `64/256 spp  0:12, 0:36 left  14.2 Mpaths/s  error 1.3 %`.
impl std::fmt::Display for Snapshot {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.samples == 0 && self.spp == 0 && self.spp_total.is_none() {
            // Of work that is not counted in samples, or before there are any.
            write!(formatter, "{}", clock(self.elapsed))?;
            return match self.remaining {
                Some(remaining) => write!(formatter, ", {} left", clock(remaining)),
                None => Ok(()),
            };
        }
        write!(formatter, "{}", self.spp)?;
        if let Some(total) = self.spp_total {
            write!(formatter, "/{total}")?;
        }
        write!(formatter, " spp  {}", clock(self.elapsed))?;
        if let Some(remaining) = self.remaining {
            write!(formatter, ", {} left", clock(remaining))?;
        }
        write!(
            formatter,
            "  {} Mpaths/s",
            significant(self.paths_per_second / 1e6, 3)
        )?;
        match self.error {
            Some(error) => write!(formatter, "  error {} %", significant(100.0 * error, 2)),
            None => Ok(()),
        }
    }
}

/// As in `0:07`, `12:30` or `1:02:03`.
fn clock(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    match hours {
        0 => format!("{minutes}:{seconds:02}"),
        _ => format!("{hours}:{minutes:02}:{seconds:02}"),
    }
}

/// A number with so many significant digits, but all digits before the point and no exponent.
fn significant(number: f64, digits: i32) -> String {
    if number == 0.0 || !number.is_finite() {
        return number.to_string();
    }
    let decimals = digits - 1 - number.abs().log10().floor() as i32;
    // Smaller numbers than this are of no interest to anyone who watches.
    format!("{number:.*}", decimals.clamp(0, 6) as usize)
}

fn bar_style() -> ProgressStyle {
    let colourless = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let bar = if colourless {
        "{bar:24}"
    } else {
        "{bar:24.cyan/blue}"
    };
    // The text is last and cut to what room there is.
    ProgressStyle::with_template(&format!("{bar} {{percent:>3}} %  {{wide_msg}}"))
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("━╸─")
}
