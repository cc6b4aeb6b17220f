//! Log of a training: `metrics.jsonl`, one JSON object with a `step` per line, and the same values as an event file for
//! TensorBoard. A resumed training drops the lines after its checkpoint's step, so both files are identical to those of
//! an uninterrupted training.

use anyhow::{Context, Result};
use orator_base::stage::workdir;
use orator_formats::tfevents;
use serde::Serialize;
use serde_json::{Value, json};
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Name of the JSON lines file in the folder of a training.
pub const FILE: &str = "metrics.jsonl";

/// An open log, to which lines are appended.
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

    /// Appends a line to both files.
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

/// A file opened for appending.
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
}
