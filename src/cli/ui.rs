//! What a verb prints: progress bars on standard error, a closing summary (or one JSON object) on standard output.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use orator::stage::progress::{Progress, Task};
use std::io::{ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The terminal, or its absence. An output that cannot be written never ends the work.
pub struct Ui {
    json: bool,
    bars: MultiProgress,
    has_lost_output: AtomicBool,
}

impl Ui {
    /// With `json` the summary is one JSON object; bars go to standard error and hide themselves where that is no terminal.
    pub fn new(json: bool) -> Self {
        Self { json, bars: MultiProgress::new(), has_lost_output: AtomicBool::new(false) }
    }

    /// The closing words of a verb: the summary for people and the next command to type, or `facts` for programs.
    pub fn summary(&self, text: &str, next: Option<&str>, facts: serde_json::Value) {
        if self.json {
            return self.print(&facts.to_string());
        }
        let next = next.map(|next| format!("\nnext: {next}")).unwrap_or_default();
        self.print(&format!("{}{next}", text.trim_end()));
    }

    /// An error that ended the verb.
    pub fn error(&self, error: &anyhow::Error) {
        note(&format!("error: {error:#}"));
        if self.json {
            self.print(&serde_json::json!({ "error": format!("{error:#}") }).to_string());
        }
    }

    /// Whether standard output could not take all that was written to it (a full disk).
    pub fn has_lost_output(&self) -> bool {
        self.has_lost_output.load(Ordering::Relaxed)
    }

    /// Writes a line on standard output. A reader who has gone away (`orator status | head`) is no failure.
    fn print(&self, line: &str) {
        let mut out = std::io::stdout();
        if let Err(error) = writeln!(out, "{line}").and_then(|()| out.flush())
            && error.kind() != ErrorKind::BrokenPipe
        {
            self.has_lost_output.store(true, Ordering::Relaxed);
            note(&format!("error: cannot write to standard output: {error}"));
        }
    }
}

/// Writes a line on standard error, where that can still be written.
pub fn note(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

impl Progress for Ui {
    fn begin(&self, label: &str, total: u64) -> Box<dyn Task> {
        let template = if total == 0 {
            "{prefix:28!} {spinner} {pos} in {elapsed} {wide_msg}"
        } else {
            "{prefix:28!} {bar:24} {pos}/{len} {elapsed} left {eta} {wide_msg}"
        };
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = if total == 0 { ProgressBar::new_spinner() } else { ProgressBar::new(total) };
        let bar = self.bars.add(bar.with_style(style).with_prefix(label.to_owned()));
        bar.enable_steady_tick(Duration::from_millis(200));
        Box::new(Bar(bar))
    }

    fn say(&self, line: &str) {
        // `MultiProgress::suspend` would panic on a terminal that is gone.
        if self.bars.is_hidden() {
            note(line);
        } else {
            let _ = self.bars.println(line);
        }
    }
}

struct Bar(ProgressBar);

impl Task for Bar {
    fn advance(&self, steps: u64) {
        self.0.inc(steps);
    }
    fn detail(&self, text: &str) {
        self.0.set_message(text.to_owned());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
