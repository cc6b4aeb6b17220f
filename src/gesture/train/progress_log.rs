//! Progress lines of a training, printed at least twice a minute and after every twentieth of its steps.

use orator_base::text::duration;
use std::time::{Duration, Instant};

/// Longest time between two lines, checked after each step.
const MAX_SILENCE: Duration = Duration::from_secs(30);
/// Minimum number of lines of a complete training, if it has at least that many steps.
const MIN_LINES: usize = 20;

/// Decides when a progress line is due, and measures the speed and the remaining time of the current run.
pub struct ProgressLog {
    first_step: usize,
    steps: usize,
    start: Instant,
    last_logged_step: usize,
    last_logged: Instant,
}

impl ProgressLog {
    /// Starts the clock of a run that continues after step `first_step` of a training of `steps` steps in total.
    pub fn new(first_step: usize, steps: usize) -> Self {
        let now = Instant::now();
        Self { first_step, steps, start: now, last_logged_step: first_step, last_logged: now }
    }

    /// Mean steps per second of this run up to `step`; validation and checkpoints between the steps count.
    pub fn per_sec(&self, step: usize) -> f64 {
        (step - self.first_step) as f64 / self.start.elapsed().as_secs_f64().max(1e-9)
    }

    /// Progress line after `step`, or `None` if none is due; `summary` lists the losses of the step.
    pub fn line(&mut self, step: usize, summary: &str) -> Option<String> {
        if !self.is_due(step, self.last_logged.elapsed()) {
            return None;
        }
        (self.last_logged_step, self.last_logged) = (step, Instant::now());
        let (steps, speed) = (self.steps, self.per_sec(step));
        let left = duration(steps.saturating_sub(step) as f64 / speed.max(1e-9));
        Some(format!("step {step} of {steps}: {summary}, {speed:.2} steps/s, {left} left"))
    }

    fn is_due(&self, step: usize, silence: Duration) -> bool {
        let parts = |step: usize| step * MIN_LINES / self.steps.max(1);
        silence >= MAX_SILENCE || parts(step) > parts(self.last_logged_step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_due_every_twentieth_of_the_steps_or_half_a_minute() {
        let log = ProgressLog::new(100, 900);
        let soon = Duration::from_secs(29);
        assert!(!log.is_due(134, soon) && log.is_due(135, soon) && log.is_due(101, MAX_SILENCE));
        let mut short = ProgressLog::new(0, 12);
        let lines: Vec<String> = (1..=12).filter_map(|step| short.line(step, "L1 0.5")).collect();
        assert_eq!(lines.len(), 12);
        assert!(lines[2].starts_with("step 3 of 12: L1 0.5, ") && lines[11].ends_with(", 0 s left"), "{lines:?}");
    }
}
