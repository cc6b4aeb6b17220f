//! Output of a verb: progress bars on standard error, a final summary (or one JSON object) on standard output.

use super::renamed::with_old_keys;
use super::signals::StopRequest;
use indicatif::{MultiProgress, ProgressBar, ProgressState, ProgressStyle};
use orator_base::stage::progress::{PARTS, Progress, Task};
use orator_base::text::duration;
use std::borrow::Cow;
use std::fmt;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// The terminal, if any. Failing to write output never stops the work.
pub struct Ui {
    json: bool,
    verb: String,
    bars: MultiProgress,
    has_output_error: AtomicBool,
    stop: StopRequest,
}

impl Ui {
    /// With `json` the summary is one JSON object, which also contains the old names of renamed keys of `verb`. Bars go
    /// to standard error and are hidden if that is not a terminal.
    pub fn new(json: bool, verb: String) -> Self {
        Self {
            json,
            verb,
            bars: MultiProgress::new(),
            has_output_error: AtomicBool::new(false),
            stop: StopRequest::default(),
        }
    }

    /// Prints the result of a verb: the summary and the next command to type, or `facts` with `--json`.
    pub fn summary(&self, text: &str, next: Option<&str>, facts: serde_json::Value) {
        if self.json {
            return self.print(&with_old_keys(&self.verb, facts).to_string());
        }
        let next = next.map(|next| format!("\nnext: {next}")).unwrap_or_default();
        self.print(&format!("{}{next}", text.trim_end()));
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
            let left = secs_left(state, skipped.load(Ordering::Relaxed));
            let _ = match left {
                Some(left) => write!(out, "{}", duration(left.as_secs_f64())),
                None => write!(out, "unknown time"),
            };
        };
        let spent = |state: &ProgressState, out: &mut dyn fmt::Write| {
            let _ = write!(out, "{}", duration(state.elapsed().as_secs_f64()));
        };
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = self
            .bars
            .add(bar.with_style(style.with_key("left", left).with_key("spent", spent)).with_prefix(label.to_owned()));
        bar.enable_steady_tick(Duration::from_millis(200));
        Box::new(Bar { bar, n_skipped })
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

/// Estimated remaining time at the current rate; `None` before any step that took time.
fn secs_left(state: &ProgressState, n_skipped: u64) -> Option<Duration> {
    let done = state.pos().saturating_sub(n_skipped);
    let left = state.len()?.saturating_sub(state.pos());
    (done > 0).then(|| state.elapsed().mul_f64(left as f64 / done as f64))
}

struct Bar {
    bar: ProgressBar,
    /// Steps that needed no work.
    n_skipped: Arc<AtomicU64>,
}

impl Task for Bar {
    fn advance(&self, steps: u64) {
        self.bar.inc(steps);
    }
    fn skip(&self, steps: u64) {
        self.n_skipped.fetch_add(steps, Ordering::Relaxed);
        self.bar.inc(steps);
    }
    fn detail(&self, text: &str) {
        self.bar.set_message(sanitised(text).into_owned());
    }
    fn milestone(&self, line: &str) {
        if self.bar.is_hidden() {
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
