//! Result of a measured part, and progress bars on standard error.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use orator_base::math::order;
use orator_base::stage::progress::{Progress, Task};

/// A result: as text and as one JSON object.
pub(crate) struct Report {
    pub(crate) text: String,
    pub(crate) facts: serde_json::Value,
}

/// Median over the rounds, the larger of the two middle values for an even number; NaN without rounds.
pub(crate) fn median(rounds: Vec<f64>) -> f64 {
    order::upper_median(rounds).unwrap_or(f64::NAN)
}

/// Progress bars on standard error, hidden if that is not a terminal.
#[derive(Default)]
pub(crate) struct Bars(MultiProgress);

impl Progress for Bars {
    fn begin(&self, label: &str, total: u64) -> Box<dyn Task> {
        let bar = if total == 0 { ProgressBar::new_spinner() } else { ProgressBar::new(total) };
        let style = ProgressStyle::with_template("{prefix:24!} {pos}/{len} {elapsed} {wide_msg}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        Box::new(Bar(self.0.add(bar.with_style(style).with_prefix(label.to_owned()))))
    }

    fn say(&self, line: &str) {
        self.0.suspend(|| eprintln!("{line}"));
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
