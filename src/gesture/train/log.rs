//! Log of a training: `metrics.jsonl`, one JSON object with a `step` per line, and the same values as an event file for
//! TensorBoard. A resumed training drops the lines after its checkpoint's step, so both files equal those of an
//! uninterrupted training. Progress lines are printed at least twice a minute and after every twentieth of the steps.

use anyhow::{Context, Result};
use orator_base::stage::workdir;
use orator_base::text::duration;
use orator_formats::tfevents;
use serde::Serialize;
use serde_json::{Value, json};
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the JSON lines file in the folder of a training.
pub const FILE: &str = "metrics.jsonl";

pub struct MetricsLog {
    lines: AppendedFile,
    events: Option<AppendedFile>,
}

impl MetricsLog {
    /// Opens the log in `folder`, creating it if missing, and keeps the lines up to `step`.
    pub fn open(folder: &Path, step: usize) -> Result<Self> {
        let mut log = Self::lines_alone(&folder.join(FILE), step)?;
        let records = read(folder)?.iter().filter_map(tfevents::record).collect();
        let start = [vec![tfevents::first()], records].concat().concat();
        log.events = Some(AppendedFile::open(&folder.join(tfevents::FILE), &start)?);
        Ok(log)
    }

    /// Opens the file `path` as a log without an event file, and keeps the lines up to `step`.
    pub fn lines_alone(path: &Path, step: usize) -> Result<Self> {
        let text = text(path)?;
        // A training without a checkpoint starts over, including the validation before its first step.
        let is_kept = |line: &&str| step > 0 && parsed(line).is_some_and(|line| step_of(&line) <= step as u64);
        let accepted: String = text.lines().filter(is_kept).map(|line| format!("{line}\n")).collect();
        Ok(Self { lines: AppendedFile::open(path, accepted.as_bytes())?, events: None })
    }

    pub fn write(&mut self, line: &Value) -> Result<()> {
        let text = line.to_string();
        self.lines.add(format!("{text}\n").as_bytes())?;
        // The event is built from the parsed text, as on resuming: a number read back may differ in its last digit.
        match (&mut self.events, parsed(&text).as_ref().and_then(tfevents::record)) {
            (Some(events), Some(record)) => events.add(&record),
            _ => Ok(()),
        }
    }
}

/// Log line of a step: the serialised losses with the key `step`.
pub fn line(step: usize, losses: &impl Serialize) -> Value {
    let mut line = json!({ "step": step });
    if let (Some(line), Ok(Value::Object(losses))) = (line.as_object_mut(), serde_json::to_value(losses)) {
        line.extend(losses);
    }
    line
}

/// Complete lines of the log in `folder`; empty if there is no log.
pub fn read(folder: &Path) -> Result<Vec<Value>> {
    Ok(text(&folder.join(FILE))?.lines().filter_map(parsed).collect())
}

fn text(path: &Path) -> Result<String> {
    match std::fs::read_to_string(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(String::new()),
        text => text.with_context(|| format!("cannot read {}", path.display())),
    }
}

/// Parsed line of a log; `None` for a line that was only partly written.
fn parsed(line: &str) -> Option<Value> {
    serde_json::from_str::<Value>(line).ok().filter(|line| line["step"].is_u64())
}

fn step_of(line: &Value) -> u64 {
    line["step"].as_u64().unwrap_or(u64::MAX)
}

struct AppendedFile {
    path: PathBuf,
    file: File,
}

impl AppendedFile {
    fn open(path: &Path, start: &[u8]) -> Result<Self> {
        workdir::write_file(path, start)?;
        let file = OpenOptions::new().append(true).open(path);
        Ok(Self { file: file.with_context(|| format!("cannot write {}", path.display()))?, path: path.to_owned() })
    }

    fn add(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).with_context(|| format!("cannot write {}", self.path.display()))
    }
}

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
    fn resuming_drops_lines_after_the_checkpoint() -> Result<()> {
        let (folder, other) = (tempfile::tempdir()?, tempfile::tempdir()?);
        let mut log = MetricsLog::open(folder.path(), 0)?;
        for step in [10, 20, 30] {
            log.write(&json!({"step": step, "l1": 0.1 + 0.2}))?;
        }
        log.lines.add(b"{\"step\": 40, \"l")?;
        if let Some(events) = &mut log.events {
            events.add(&[1, 2, 3])?;
        }
        MetricsLog::open(folder.path(), 20)?.write(&json!({"step": 30, "l1": 0.25}))?;
        let bytes = |folder: &Path, file: &str| std::fs::read(folder.join(file));
        let text = bytes(folder.path(), FILE)?;
        let expected = "{\"step\":10,\"l1\":0.30000000000000004}\n{\"step\":20,\"l1\":0.30000000000000004}\n{\"step\":30,\"l1\":0.25}\n";
        assert_eq!(text, expected.as_bytes());
        let mut uninterrupted = MetricsLog::open(other.path(), 0)?;
        read(folder.path())?.iter().try_for_each(|line| uninterrupted.write(line))?;
        assert_eq!(bytes(folder.path(), tfevents::FILE)?, bytes(other.path(), tfevents::FILE)?);
        Ok(())
    }

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
