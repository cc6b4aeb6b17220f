//! Timing of stages: the time per unit in a run.

use super::pipeline::Pipeline;
use super::process::{Limits, answer_media, ask_media};
use super::stages::UnitWork;
use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::{Report, Unit};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Processing time of a stage for one unit.
#[derive(Clone, Debug, PartialEq)]
pub struct StageTime {
    pub stage: StageName,
    pub unit: Unit,
    pub secs: f64,
}

#[derive(Default)]
pub struct StageClock(Mutex<Vec<StageTime>>);

impl StageClock {
    /// Runs `work` and records its time, also if it fails.
    pub fn time(&self, stage: &str, unit: &Unit, work: UnitWork) -> Result<Report> {
        let start = Instant::now();
        let report = work();
        if let Ok(stage) = stage.parse() {
            let time = StageTime { stage, unit: unit.clone(), secs: start.elapsed().as_secs_f64() };
            self.0.lock().unwrap_or_else(PoisonError::into_inner).push(time);
        }
        report
    }

    /// Removes and returns the recorded times, in order of completion.
    pub fn take(&self) -> Vec<StageTime> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Pipeline {
    /// Duration of a video in seconds, if its header states it. Uses a subprocess if the pipeline has a program for it.
    ///
    /// # Errors
    /// A video that cannot be read.
    pub fn ask_media(&self, source: &Path) -> Result<Option<f64>> {
        let header = match self.program() {
            Some(program) => ask_media(program, source, &Limits::of_header()),
            None => answer_media(source),
        };
        Ok(header?.secs)
    }
}
