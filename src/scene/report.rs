//! Errors and warnings about a scene file, each with its place in the text.
//!
//! A [`Problem`] says what is wrong, where, and what to do; a [`Report`] collects them and renders
//! them with the file, the line, the column and the line itself, in the order of the file.

use std::borrow::Cow;
use std::ops::Range;

use codespan_reporting::diagnostic::{Diagnostic, Label, Severity};
use codespan_reporting::files;
use codespan_reporting::term;

/// At most so many problems are shown: one mistake in a generated file can repeat a million times.
pub(super) const SHOWN: usize = 20;

/// Of a longer line, only this many bytes around the place are shown.
const LINE_WINDOW: usize = 160;

/// Of a longer message, which then repeats a key or a name of the file, only the beginning and the
/// end are shown.
const LONGEST_TEXT: usize = 1000;

/// Something to tell about one place of a scene file.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    /// What is wrong, in one line.
    pub(super) message: String,
    /// The bytes concerned.
    pub(super) span: Range<usize>,
    /// What is said at the place itself; may be empty.
    pub(super) label: String,
    /// A second place that explains the first.
    pub(super) also: Option<(Range<usize>, String)>,
    /// What to do about it.
    pub(super) help: Option<String>,
}

impl Problem {
    /// A problem without help and without a second place.
    pub(super) fn new(
        span: Range<usize>,
        message: impl Into<String>,
        label: impl Into<String>,
    ) -> Self {
        Self {
            message: message.into(),
            span,
            label: label.into(),
            also: None,
            help: None,
        }
    }

    /// Adds what to do about it.
    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds a second place that explains the first.
    pub(super) fn also(mut self, span: Range<usize>, label: impl Into<String>) -> Self {
        self.also = Some((span, label.into()));
        self
    }
}

/// The problems of one scene file.
#[derive(Debug, Default)]
pub(super) struct Report {
    /// What makes the scene unusable.
    pub(super) errors: Vec<Problem>,
    /// What is legal and probably not meant.
    pub(super) warnings: Vec<Problem>,
}

impl Report {
    /// The errors as one text, in the order of the file; `None` without errors.
    pub(super) fn error_text(&self, name: &str, text: &str) -> Option<String> {
        if self.errors.is_empty() {
            return None;
        }
        let mut rendered = render(name, text, &self.errors, Severity::Error);
        let more = self.errors.len().saturating_sub(SHOWN);
        if more > 0 {
            rendered.push(format!("error: and {more} more like these"));
        }
        Some(rendered.join("\n\n"))
    }

    /// The warnings, one text each, in the order of the file.
    pub(super) fn warning_texts(&self, name: &str, text: &str) -> Vec<String> {
        let mut rendered = render(name, text, &self.warnings, Severity::Warning);
        let more = self.warnings.len().saturating_sub(SHOWN);
        if more > 0 {
            rendered.push(format!("warning: and {more} more like these"));
        }
        rendered
    }
}

fn render(name: &str, text: &str, problems: &[Problem], severity: Severity) -> Vec<String> {
    if problems.is_empty() {
        return Vec::new();
    }
    let source = Source::new(name, text);
    let mut ordered: Vec<_> = problems.iter().collect();
    ordered.sort_by_key(|problem| problem.span.start);
    ordered
        .into_iter()
        .take(SHOWN)
        .map(|problem| source.render(problem, severity))
        .collect()
}

/// The text of a file, made safe to show, with the starts of its lines.
struct Source<'a> {
    name: Cow<'a, str>,
    text: Cow<'a, str>,
    line_starts: Vec<usize>,
}

impl<'a> Source<'a> {
    fn new(name: &'a str, text: &'a str) -> Self {
        let mut line_starts = vec![0];
        line_starts.extend(text.match_indices('\n').map(|(index, _)| index + 1));
        Self {
            name: printable(name),
            text: printable(text),
            line_starts,
        }
    }

    fn render(&self, problem: &Problem, severity: Severity) -> String {
        let span = self.on_one_line(&problem.span);
        let view = View {
            source: self,
            focus: span.clone(),
        };
        let label = shortened(&problem.label);
        let mut labels = vec![Label::primary((), span.clone()).with_message(label)];
        if let Some((also, label)) = &problem.also {
            let also = self.on_one_line(also);
            // The window of a long line is chosen for the first place and may exclude this one.
            let line = self.line(self.line_of(also.start)).unwrap_or_default();
            if line.len() <= LINE_WINDOW {
                labels.push(Label::secondary((), also).with_message(shortened(label)));
            }
        }
        let diagnostic = Diagnostic::new(severity)
            .with_message(shortened(&problem.message))
            .with_labels(labels)
            .with_notes(
                problem
                    .help
                    .iter()
                    .map(|help| format!("help: {}", shortened(help)))
                    .collect(),
            );
        match term::emit_into_string(&term::Config::default(), &view, &diagnostic) {
            Ok(text) => text
                .lines()
                .map(str::trim_end)
                .collect::<Vec<_>>()
                .join("\n")
                .trim_end()
                .to_owned(),
            // Cannot happen for spans that `on_one_line` made, but an error must get through.
            Err(_) => {
                let line = self.line_of(span.start) + 1;
                let message = shortened(&problem.message);
                format!("error: {message}\n  {}:{line}", self.name)
            }
        }
    }

    /// The part of the span that lies on its first line and is short enough to be shown, at
    /// character boundaries and on an existing line: a place after the last newline is moved to the
    /// end of the last line.
    fn on_one_line(&self, span: &Range<usize>) -> Range<usize> {
        let mut start = self.text.floor_char_boundary(span.start);
        if start == self.text.len() && self.text.ends_with('\n') {
            start -= 1;
        }
        let line_end = self.text[start..]
            .find('\n')
            .map_or(self.text.len(), |length| start + length);
        let end = self.text.ceil_char_boundary(span.end).min(line_end);
        let most = self.text.ceil_char_boundary(start + LINE_WINDOW);
        start..end.min(most).max(start)
    }

    fn line_of(&self, byte: usize) -> usize {
        self.line_starts.partition_point(|&start| start <= byte) - 1
    }

    fn line(&self, index: usize) -> Option<Range<usize>> {
        let start = *self.line_starts.get(index)?;
        let end = self
            .line_starts
            .get(index + 1)
            .copied()
            .unwrap_or(self.text.len());
        Some(start..end)
    }
}

/// A source as one problem sees it: of its own line, if that is long, only a window.
struct View<'a> {
    source: &'a Source<'a>,
    focus: Range<usize>,
}

impl<'a> files::Files<'a> for View<'a> {
    type FileId = ();
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, (): ()) -> Result<&'a str, files::Error> {
        Ok(&self.source.name)
    }

    fn source(&'a self, (): ()) -> Result<&'a str, files::Error> {
        Ok(&self.source.text)
    }

    fn line_index(&'a self, (): (), byte: usize) -> Result<usize, files::Error> {
        Ok(self.source.line_of(byte))
    }

    // The column in the file, not in the window.
    fn column_number(&'a self, (): (), line: usize, byte: usize) -> Result<usize, files::Error> {
        let range = self.source.line(line).ok_or(files::Error::FileMissing)?;
        let byte = self.source.text.floor_char_boundary(byte);
        // A byte order mark is no column of its own in any editor.
        let before = &self.source.text[range.start..byte.clamp(range.start, range.end)];
        Ok(before.trim_start_matches('\u{feff}').chars().count() + 1)
    }

    fn line_range(&'a self, (): (), line: usize) -> Result<Range<usize>, files::Error> {
        let range = self.source.line(line).ok_or(files::Error::FileMissing)?;
        if range.len() <= LINE_WINDOW {
            return Ok(range);
        }
        let text = &self.source.text;
        let focus = self.focus.start.clamp(range.start, range.end);
        let start = text.floor_char_boundary(focus.saturating_sub(LINE_WINDOW / 2));
        let end = self.focus.end.max(focus).min(range.end) + LINE_WINDOW / 2;
        Ok(start.max(range.start)..text.ceil_char_boundary(end).min(range.end))
    }
}

/// The text, without its middle if it is long.
fn shortened(text: &str) -> Cow<'_, str> {
    if text.len() <= LONGEST_TEXT {
        return Cow::Borrowed(text);
    }
    let head = &text[..text.floor_char_boundary(LONGEST_TEXT / 2)];
    let tail = &text[text.ceil_char_boundary(text.len() - LONGEST_TEXT / 4)..];
    Cow::Owned(format!("{head} … {tail}"))
}

/// The text with control and direction-changing characters replaced by visible ones of the same
/// length in bytes: a scene file must not be able to drive the terminal.
fn printable(text: &str) -> Cow<'_, str> {
    let unsafe_to_show = |c: char| {
        (c.is_control() && !matches!(c, '\n' | '\t'))
            || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(unsafe_to_show) {
        return Cow::Borrowed(text);
    }
    let replace = |c: char| match (unsafe_to_show(c), c.len_utf8()) {
        (false, _) => c,
        (true, 1) if c == '\r' => ' ',
        (true, 1) => '?',
        (true, 2) => '·',
        (true, _) => char::REPLACEMENT_CHARACTER,
    };
    Cow::Owned(text.chars().map(replace).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str, span: Range<usize>) -> String {
        let report = Report {
            errors: vec![Problem::new(span, "wrong", "here")],
            warnings: Vec::new(),
        };
        report.error_text("a.toml", text).expect("one error")
    }

    #[test]
    fn every_span_of_every_text_can_be_shown() {
        for text in [
            "",
            "\n",
            "a",
            "é\r\nb = [1,\n 2]\n",
            "\u{feff}a = \u{1b}[2J\u{9b}\u{202e}\n",
        ] {
            for start in 0..=text.len() + 1 {
                for end in start..=text.len() + 2 {
                    let shown = shown(text, start..end);
                    assert!(shown.starts_with("error: wrong\n"), "{shown}");
                    assert!(shown.contains("┌─ a.toml:"), "{shown}");
                    let controls = |c: char| c.is_control() && c != '\n';
                    assert!(!shown.contains(controls), "{shown:?}");
                }
            }
        }
    }

    #[test]
    fn columns_count_characters() {
        assert!(shown("é = 1\nü = 2 x", 7..9).contains("a.toml:2:1"));
        assert!(shown("é = 1\nü = 2 x", 14..15).contains("a.toml:2:7"));
        assert!(shown("\u{feff}ab", 4..5).contains("a.toml:1:2"));
    }

    #[test]
    fn the_end_of_the_file_is_its_last_line() {
        assert!(shown("a = 1\n", 6..6).contains("a.toml:1:6"));
    }

    #[test]
    fn a_long_line_is_cut_and_keeps_its_column() {
        let text = format!("a = [{}]", "1234, ".repeat(100_000));
        let shown = shown(&text, 300_005..300_009);
        assert!(shown.contains("a.toml:1:300006"), "{shown}");
        assert!(shown.len() < 1000, "{}", shown.len());
    }

    #[test]
    fn a_long_name_is_cut_wherever_it_is_repeated() {
        let name = "é".repeat(30_000);
        let text = format!("{name} = 1");
        let problem = Problem::new(0..name.len(), format!("unknown `{name}` here"), &name);
        let problem = problem.help(format!("not {name} but x"));
        let report = Report {
            errors: vec![problem],
            warnings: Vec::new(),
        };
        let shown = report.error_text("a.toml", &text).expect("one error");
        assert!(shown.starts_with("error: unknown `é"), "{shown}");
        assert!(shown.contains("é` here\n"), "{shown}");
        assert!(shown.contains("a.toml:1:1\n"), "{shown}");
        assert!(shown.ends_with("é but x"), "{shown}");
        assert!(shown.len() < 6000, "{}: {shown}", shown.len());
    }

    #[test]
    fn a_second_place_outside_of_the_window_is_left_out() {
        for (text, shown) in [
            ("a = 1, b = 2".to_owned(), true),
            ("a = 1, ".repeat(100), false),
        ] {
            let end = text.len();
            let problem = Problem::new(0..1, "wrong", "here").also(end - 1..end, "there");
            let report = Report {
                errors: vec![problem],
                warnings: Vec::new(),
            };
            let rendered = report.error_text("a.toml", &text).expect("one error");
            assert_eq!(rendered.contains("there"), shown, "{rendered}");
            assert!(rendered.len() < 1000, "{rendered}");
        }
    }

    #[test]
    fn a_flood_of_errors_is_cut() {
        let report = Report {
            errors: vec![Problem::new(0..1, "wrong", ""); 1000],
            warnings: Vec::new(),
        };
        let text = report.error_text("a.toml", "a").expect("errors");
        assert_eq!(text.matches("wrong").count(), SHOWN);
        assert!(text.ends_with("and 980 more like these"));
    }
}
