//! What a verb prints: progress bars on standard error, a closing summary (or one JSON object) on standard output.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use orator::stage::progress::{Progress, Task};
use std::io::Write;
use std::time::Duration;

/// The terminal, or its absence.
pub struct Ui {
    json: bool,
    bars: MultiProgress,
}

impl Ui {
    /// With `json` the summary is one JSON object; bars go to standard error and hide themselves where that is no terminal.
    pub fn new(json: bool) -> Self {
        Self { json, bars: MultiProgress::new() }
    }

    /// The closing words of a verb: the summary for people and the next command to type, or `facts` for programs.
    pub fn summary(&self, text: &str, next: Option<&str>, facts: serde_json::Value) {
        if self.json {
            return say(&facts.to_string());
        }
        say(text.trim_end());
        if let Some(next) = next {
            say(&format!("next: {next}"));
        }
    }

    /// An error that ended the verb.
    pub fn error(&self, error: &anyhow::Error) {
        eprintln!("error: {error:#}");
        if self.json {
            say(&serde_json::json!({ "error": format!("{error:#}") }).to_string());
        }
    }
}

/// A line on standard output. That nobody reads it any more (`orator status | head`) is no failure.
fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
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
        self.bars.suspend(|| eprintln!("{line}"));
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
