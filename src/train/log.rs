//! The log of a training: one JSON object a line, each with its `step`. A resumed training drops the lines that its
//! checkpoint has not seen, so that the file is the one of an undisturbed training.

use crate::stage::workdir;
use anyhow::{Context, Result};
use serde_json::Value;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The open log.
pub struct Log {
    path: PathBuf,
    file: File,
}

impl Log {
    /// Opens the file `path`, made if missing, with the lines up to `step`.
    pub fn open(path: &Path, step: usize) -> Result<Self> {
        let path = path.to_owned();
        let old = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", path.display())),
        };
        let seen = |line: &&str| {
            let step_of_line = serde_json::from_str::<Value>(line).ok().and_then(|value| value["step"].as_u64());
            step_of_line.is_some_and(|of_line| of_line <= step as u64)
        };
        let kept: String = old.lines().filter(seen).map(|line| format!("{line}\n")).collect();
        workdir::write_file(&path, kept.as_bytes())?;
        let file = OpenOptions::new().append(true).open(&path);
        Ok(Self { file: file.with_context(|| format!("cannot write {}", path.display()))?, path })
    }

    /// Adds a line.
    pub fn write(&mut self, line: &Value) -> Result<()> {
        writeln!(self.file, "{line}").with_context(|| format!("cannot write {}", self.path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn resuming_drops_what_the_checkpoint_has_not_seen() -> Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("metrics.jsonl");
        let mut log = Log::open(&path, 0)?;
        for step in [10, 20, 30] {
            log.write(&json!({"step": step, "l1": 0.5}))?;
        }
        log.file.write_all(b"{\"step\": 40, \"l")?;
        Log::open(&path, 20)?.write(&json!({"step": 30, "l1": 0.25}))?;
        let text = std::fs::read_to_string(path)?;
        assert_eq!(text, "{\"step\":10,\"l1\":0.5}\n{\"step\":20,\"l1\":0.5}\n{\"step\":30,\"l1\":0.25}\n");
        Ok(())
    }
}
