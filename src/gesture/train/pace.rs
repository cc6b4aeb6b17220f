//! How far a training is, told now and then: at least twice a minute and every twentieth of its steps.

use std::time::{Duration, Instant};

/// Longest silence while steps are done.
const EVERY: Duration = Duration::from_secs(30);
/// Lines that tell of a whole training, however short.
const N_LINES: usize = 20;

/// Steps and time since the last line.
pub struct TrainingPace {
    began_at: usize,
    steps: usize,
    start: Instant,
    told_at: usize,
    told: Instant,
}

impl TrainingPace {
    /// A training of `steps` steps altogether whose run begins now, behind step `began_at`.
    pub fn new(began_at: usize, steps: usize) -> Self {
        let now = Instant::now();
        Self { began_at, steps, start: now, told_at: began_at, told: now }
    }

    /// Steps a second of this run up to `step`, with all that was done between them.
    pub fn per_sec(&self, step: usize) -> f64 {
        (step - self.began_at) as f64 / self.start.elapsed().as_secs_f64().max(1e-9)
    }

    /// The line of a step that is done, where one is due; `words` are its losses.
    pub fn line(&mut self, step: usize, words: &str) -> Option<String> {
        if !self.is_due(step, self.told.elapsed()) {
            return None;
        }
        (self.told_at, self.told) = (step, Instant::now());
        let (steps, speed) = (self.steps, self.per_sec(step));
        let left = duration(steps.saturating_sub(step) as f64 / speed.max(1e-9));
        Some(format!("step {step} of {steps}: {words}, {speed:.2} steps/s, {left} left"))
    }

    fn is_due(&self, step: usize, silence: Duration) -> bool {
        let parts = |step: usize| step * N_LINES / self.steps.max(1);
        silence >= EVERY || parts(step) > parts(self.told_at)
    }
}

/// Seconds in words, for people.
fn duration(secs: f64) -> String {
    match secs.round() as u64 {
        secs if secs < 60 => format!("{secs} s"),
        secs if secs < 3600 => format!("{} min {:02} s", secs / 60, secs % 60),
        secs => format!("{} h {:02} min", secs / 3600, secs / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_due_every_twentieth_or_half_a_minute() {
        let pace = TrainingPace::new(100, 900);
        let soon = Duration::from_secs(29);
        assert!(!pace.is_due(134, soon) && pace.is_due(135, soon) && pace.is_due(101, EVERY));
        let mut short = TrainingPace::new(0, 12);
        let lines: Vec<String> = (1..=12).filter_map(|step| short.line(step, "L1 0.5")).collect();
        assert_eq!(lines.len(), 12);
        assert!(lines[2].starts_with("step 3 of 12: L1 0.5, ") && lines[11].ends_with(", 0 s left"), "{lines:?}");
    }

    #[test]
    fn durations_are_read_at_a_glance() {
        assert_eq!([59.4, 61.0, 3599.4, 7384.0].map(duration), ["59 s", "1 min 01 s", "59 min 59 s", "2 h 03 min"]);
    }
}
