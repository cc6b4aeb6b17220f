//! One attempt at a piece of work: its files are made in a folder of their own, take their place when they are whole, and
//! the record comes last.

use super::fingerprint::Fingerprint;
use super::record::{Output, Record};
use super::{Report, workdir};
use anyhow::{Context, Result, anyhow};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Runs a stage's code. A panic is a defect, but one video must not take the night's run with it.
pub fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    let caught = catch_unwind(AssertUnwindSafe(work));
    caught.unwrap_or_else(|panic| Err(anyhow!("internal error: {}", panic_text(&*panic))))
}

/// Lets `work` fill an empty folder, which then takes the place of `folder`, or whose files go into the `common` folder; the
/// record is written last.
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
        // An old record must not speak for new files, should this run be killed before it writes its own.
        Record::forget(folder)?;
        match common {
            Some(common) => workdir::move_files(&attempt, common, outputs.iter().map(|output| output.file.as_str()))?,
            None => workdir::replace_folder(&attempt, folder)?,
        }
        let Report { line, facts } = report.clone();
        Record { fingerprint: fingerprint.clone(), outputs, line, facts }.write(folder).context("cannot record it")?;
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
