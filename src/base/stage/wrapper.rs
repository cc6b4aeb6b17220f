//! A stage that wraps another stage and replaces only its work.

use super::progress::Progress;
use super::{Input, Report, Stage, Unit};
use anyhow::Result;
use std::path::{Path, PathBuf};

/// A stage that delegates everything except its work to an inner stage.
pub trait StageWrapper: Sync {
    /// Inner stage that processes `unit`; `None`: the inner stage of ordinary units.
    fn inner(&self, unit: Option<&Unit>) -> &dyn Stage;
    /// Processes the unit, as `Stage::run`.
    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        self.inner(Some(unit)).run(unit, out, progress)
    }
    /// Processes a part, as `Stage::run_part`.
    fn run_part(&self, unit: &Unit, part: usize, out: &Path, progress: &dyn Progress) -> Result<()> {
        self.inner(Some(unit)).run_part(unit, part, out, progress)
    }
}

impl<W: StageWrapper> Stage for W {
    fn name(&self) -> &'static str {
        self.inner(None).name()
    }

    fn version(&self) -> u32 {
        self.inner(None).version()
    }

    fn cost(&self) -> u32 {
        self.inner(None).cost()
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        self.inner(Some(unit)).settings(unit)
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        self.inner(Some(unit)).inputs(unit)
    }

    fn common_folder(&self) -> Option<&Path> {
        self.inner(None).common_folder()
    }

    fn needs_folder_lock(&self) -> bool {
        self.inner(None).needs_folder_lock()
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        StageWrapper::run(self, unit, out, progress)
    }

    fn n_parts(&self, unit: &Unit) -> Result<usize> {
        self.inner(Some(unit)).n_parts(unit)
    }

    fn run_part(&self, unit: &Unit, part: usize, out: &Path, progress: &dyn Progress) -> Result<()> {
        StageWrapper::run_part(self, unit, part, out, progress)
    }

    fn join(&self, unit: &Unit, parts: &[PathBuf], out: &Path) -> Result<Report> {
        self.inner(Some(unit)).join(unit, parts, out)
    }
}
