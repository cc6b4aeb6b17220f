//! One attempt at a unit of work: its files are written to a separate folder, which replaces the target when they are
//! complete, and the record is written last.

use super::fingerprint::Fingerprint;
use super::record::{Output, Record};
use super::{Report, workdir};
use anyhow::{Context, Result, anyhow};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Runs a stage's code and turns a panic, which is a bug, into an error, so that one video does not end a long run.
pub fn catch_panics<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    let caught = catch_unwind(AssertUnwindSafe(work));
    caught.unwrap_or_else(|panic| Err(anyhow!("internal error: {}", panic_text(&*panic))))
}

/// Calls `work` with an empty folder to fill. That folder then replaces `folder`, or its files are moved into
/// `common`; the record is written last.
///
/// # Errors
/// Those of `work`; the folders, the files or the record cannot be written. The attempt is then removed.
pub fn attempt(
    folder: &Path,
    common: Option<&Path>,
    fingerprint: &Fingerprint,
    work: impl FnOnce(&Path) -> Result<Report>,
) -> Result<Report> {
    let attempt = workdir::attempt_folder(folder)?;
    let finish = || -> Result<Report> {
        let report = work(&attempt).map_err(workdir::full_disk)?;
        let outputs = Output::list(&attempt)?;
        // Removed first: if the program dies before it writes the new record, the old one must not describe new files.
        Record::forget(folder)?;
        match common {
            Some(common) => workdir::move_files(&attempt, common, outputs.iter().map(|output| output.file.as_str()))?,
            None => workdir::replace_folder(&attempt, folder)?,
        }
        let Report { line, facts } = report.clone();
        Record { fingerprint: fingerprint.clone(), outputs, line, facts }
            .write(folder)
            .context("cannot write its record")?;
        Ok(report)
    };
    let finished = finish();
    if finished.is_err() {
        let _ = std::fs::remove_dir_all(&attempt);
    }
    finished
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned())).unwrap_or_else(|| "no message".to_owned())
}
