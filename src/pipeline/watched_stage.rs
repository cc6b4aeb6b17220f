//! A stage with something around every run of it: a claim is looked at, the time is taken.

use anyhow::Result;
use orator_base::stage::progress::Progress;
use orator_base::stage::{Report, Stage, StageWrapper, Unit};
use std::path::Path;

/// The work on one unit.
pub type UnitWork<'a> = &'a mut dyn FnMut() -> Result<Report>;

/// Called in place of the work on a unit of the stage of this name, which it does.
pub type Around<'a> = &'a (dyn Fn(&'static str, &Unit, UnitWork<'_>) -> Result<Report> + Sync);

/// The stage, to all but its work.
pub struct WatchedStage<'a> {
    pub stage: Box<dyn Stage + 'a>,
    pub around: Around<'a>,
}

impl StageWrapper for WatchedStage<'_> {
    fn inner(&self, _unit: Option<&Unit>) -> &dyn Stage {
        &*self.stage
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        (self.around)(self.name(), unit, &mut || self.stage.run(unit, out, progress))
    }

    fn run_part(&self, unit: &Unit, part: usize, out: &Path, progress: &dyn Progress) -> Result<()> {
        let mut work = || self.stage.run_part(unit, part, out, progress).map(|()| Report::default());
        (self.around)(self.name(), unit, &mut work).map(drop)
    }
}
