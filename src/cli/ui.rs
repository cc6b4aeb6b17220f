//! Output of a verb: progress bars on standard error, a final summary (or one JSON object) on standard output.

use super::signals::StopRequest;
use indicatif::{MultiProgress, ProgressBar, ProgressState, ProgressStyle};
use orator_base::stage::progress::{PARTS, Progress, Task};
use orator_base::text::duration;
use std::borrow::Cow;
use std::fmt;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The terminal, if any. Failing to write output never stops the work.
pub struct Ui {
    json: bool,
    bars: MultiProgress,
    has_output_error: AtomicBool,
    stop: StopRequest,
}

impl Ui {
    /// With `json` the summary is one JSON object. Bars go to standard error and are hidden if that is not a terminal.
    pub fn new(json: bool) -> Self {
        let (bars, has_output_error) = (MultiProgress::new(), AtomicBool::new(false));
        Self { json, bars, has_output_error, stop: StopRequest::default() }
    }

    /// Prints the result of a verb: the summary and the next command to type, or `facts` with `--json`.
    pub fn summary(&self, text: &str, next: Option<&str>, facts: serde_json::Value) {
        if self.json {
            return self.print(&facts.to_string());
        }
        let next = next.map(|next| format!("\nnext: {next}")).unwrap_or_default();
        self.print(&format!("{}{next}", text.trim_end()));
    }

    /// Whether results are printed as JSON.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints the error that ended the verb.
    pub fn error(&self, error: &anyhow::Error) {
        note(&format!("error: {error:#}"));
        if self.json {
            self.print(&serde_json::json!({ "error": format!("{error:#}") }).to_string());
        }
    }

    /// Asks a yes/no question; returns `false` without an interactive terminal.
    pub fn confirm(&self, question: &str) -> bool {
        let is_attended = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
        if self.json || !is_attended {
            return false;
        }
        note(&format!("{question} [y/N]"));
        let mut answer = String::new();
        std::io::stdin().read_line(&mut answer).is_ok() && answer.trim().eq_ignore_ascii_case("y")
    }

    /// Whether writing to standard output failed (for example, because of a full disk).
    pub fn has_output_error(&self) -> bool {
        self.has_output_error.load(Ordering::Relaxed)
    }

    /// From now on, the first Ctrl-C or SIGTERM requests a stop (`is_to_stop`) and prints `stopping`; the second exits
    /// the program and prints `saved`.
    pub fn enable_stop_requests(&self, stopping: &'static str, saved: &'static str) {
        self.stop.listen(stopping, saved);
    }

    /// Whether a stop was requested.
    pub fn was_stopped(&self) -> bool {
        self.stop.code().is_some()
    }

    /// Exit code of a verb that stopped on request.
    pub fn stop_code(&self) -> u8 {
        self.stop.code().unwrap_or(1)
    }

    /// Writes a line to standard output. A reader that closed the pipe (`orator status | head`) is not an error.
    fn print(&self, line: &str) {
        let mut out = std::io::stdout();
        if let Err(error) = writeln!(out, "{}", sanitised(line)).and_then(|()| out.flush())
            && error.kind() != ErrorKind::BrokenPipe
        {
            self.has_output_error.store(true, Ordering::Relaxed);
            note(&format!("error: cannot write to standard output: {error}"));
        }
    }
}

impl Progress for Ui {
    fn begin(&self, label: &str, total: u64) -> Box<dyn Task + '_> {
        let (template, bar) = match total {
            0 => ("{prefix:40!} {spinner} {pos} in {spent} {wide_msg}", ProgressBar::new_spinner()),
            PARTS => (
                "{prefix:40!} {bar:12} {percent:>3} %  {spent} elapsed, {left} left  {wide_msg}",
                ProgressBar::new(total),
            ),
            _ => {
                ("{prefix:40!} {bar:12} {pos}/{len}  {spent} elapsed, {left} left  {wide_msg}", ProgressBar::new(total))
            }
        };
        let n_skipped = Arc::new(AtomicU64::new(0));
        let skipped = n_skipped.clone();
        let left = move |state: &ProgressState, out: &mut dyn fmt::Write| {
            let (done, length) = (state.pos(), state.len().unwrap_or(0));
            let _ = out.write_str(&time_left(state.elapsed(), done, length, skipped.load(Ordering::Relaxed)));
        };
        let spent = |state: &ProgressState, out: &mut dyn fmt::Write| {
            let _ = write!(out, "{}", duration(state.elapsed().as_secs_f64()));
        };
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = self
            .bars
            .add(bar.with_style(style.with_key("left", left).with_key("spent", spent)).with_prefix(label.to_owned()));
        bar.enable_steady_tick(Duration::from_millis(200));
        let is_hidden = bar.is_hidden();
        Box::new(Bar::new(bar, is_hidden, n_skipped))
    }

    fn is_to_stop(&self) -> bool {
        self.stop.code().is_some()
    }

    fn say(&self, line: &str) {
        // `MultiProgress::suspend` would panic if the terminal has closed.
        if self.bars.is_hidden() {
            note(line);
        } else {
            let _ = self.bars.println(sanitised(line));
        }
    }
}

/// Estimated remaining time at the current rate, which is unknown before any step that took time.
fn time_left(elapsed: Duration, position: u64, length: u64, n_skipped: u64) -> String {
    match position.saturating_sub(n_skipped) {
        0 => "unknown time".to_owned(),
        done => duration(elapsed.as_secs_f64() * length.saturating_sub(position) as f64 / done as f64),
    }
}

/// Seconds between the lines of a task if there is no terminal for its bar.
const LINE_SECS: u64 = 15;

struct Bar {
    bar: ProgressBar,
    is_hidden: bool,
    begun: Instant,
    /// Seconds from the beginning after which the next line is due.
    next_line: AtomicU64,
    /// Steps that needed no work.
    n_skipped: Arc<AtomicU64>,
}

impl Bar {
    fn new(bar: ProgressBar, is_hidden: bool, n_skipped: Arc<AtomicU64>) -> Self {
        Self { bar, is_hidden, begun: Instant::now(), next_line: AtomicU64::new(LINE_SECS), n_skipped }
    }

    /// Line that replaces the bar, if one is due.
    fn line(&self, elapsed: Duration) -> Option<String> {
        if !self.is_hidden || elapsed.as_secs() < self.next_line.load(Ordering::Relaxed) {
            return None;
        }
        self.next_line.store(elapsed.as_secs() + LINE_SECS, Ordering::Relaxed);
        let (position, length) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let done = match length {
            0 => position.to_string(),
            PARTS => format!("{} %", 100 * position / PARTS),
            _ => format!("{position} of {length}"),
        };
        let spent = duration(elapsed.as_secs_f64());
        let left = match length {
            0 => String::new(),
            _ => format!(", {} left", time_left(elapsed, position, length, self.n_skipped.load(Ordering::Relaxed))),
        };
        Some(format!("{}: {done}, {spent} elapsed{left}", self.bar.prefix()))
    }
}

impl Task for Bar {
    fn advance(&self, steps: u64) {
        self.bar.inc(steps);
        if let Some(line) = self.line(self.begun.elapsed()) {
            note(&line);
        }
    }
    fn skip(&self, steps: u64) {
        self.n_skipped.fetch_add(steps, Ordering::Relaxed);
        self.bar.inc(steps);
    }
    fn detail(&self, text: &str) {
        self.bar.set_message(sanitised(text).into_owned());
    }
    fn milestone(&self, line: &str) {
        if self.is_hidden {
            // From now on, the task prints its own lines.
            self.next_line.store(u64::MAX, Ordering::Relaxed);
            note(line);
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Writes a line to standard error and ignores failures.
pub fn note(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", sanitised(line));
}

/// Replaces control characters: text from a damaged file must not control the terminal.
pub fn sanitised(text: &str) -> Cow<'_, str> {
    let commands = |letter: char| letter.is_control() && !matches!(letter, '\n' | '\t');
    if text.contains(commands) { text.replace(commands, "\u{fffd}").into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indicatif::ProgressDrawTarget;

    #[test]
    fn a_task_without_a_terminal_prints_lines() {
        let bar = |length: u64, n_skipped: u64, is_hidden: bool| {
            let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::hidden());
            let n_skipped = Arc::new(AtomicU64::new(n_skipped));
            Bar::new(bar.with_prefix("render"), is_hidden, n_skipped)
        };
        let at = |bar: &Bar, secs: u64| bar.line(Duration::from_secs(secs));
        let counted = bar(450, 50, true);
        counted.bar.inc(100);
        assert_eq!(at(&counted, LINE_SECS - 1), None);
        let expected = format!("render: 100 of 450, {} elapsed, {} left", duration(20.0), duration(140.0));
        assert_eq!(at(&counted, 20), Some(expected));
        assert_eq!((at(&counted, 34), at(&counted, 35).is_some()), (None, true));
        counted.milestone("clip 1");
        assert_eq!(at(&counted, 1_000), None);
        let parts = bar(PARTS, 0, true);
        assert!(at(&parts, 60).is_some_and(|line| line.contains("0 %, ") && line.ends_with("unknown time left")));
        assert_eq!(at(&bar(10, 0, false), 60), None);
    }
}
