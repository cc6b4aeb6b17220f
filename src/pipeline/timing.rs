//! Timing of stages: the time per unit in a run, and the same pipeline on excerpts of its videos.

use super::pipeline::Pipeline;
use super::process::message::MediaRequest;
use super::process::{Limits, answer_media, ask_media};
use super::stages::UnitWork;
use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::{Report, Unit};
use orator_dataset::config::videos::Videos;
use std::path::{Path, PathBuf};
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
    /// Duration of a video in seconds, if its header states it, or of the excerpt that was copied: see `answer_media`.
    /// Uses a subprocess if the pipeline has a program for it.
    ///
    /// # Errors
    /// A video that cannot be read; an excerpt that cannot be copied.
    pub fn ask_media(&self, request: &MediaRequest) -> Result<Option<f64>> {
        let header = match self.program() {
            Some(program) => ask_media(program, request, &Limits::of_header()),
            None => answer_media(request),
        };
        Ok(header?.secs)
    }

    /// This pipeline with `files`, pairs of speaker and path, instead of its videos, and another work folder.
    pub fn on_excerpts(&self, files: &[(String, PathBuf)], work: &Path) -> Self {
        let mut config = self.config().clone();
        config.settings.work.dir = work.to_owned();
        let speakers = self.all_videos().iter().map(|videos| &videos.speaker);
        let videos = speakers.filter(|speaker| files.iter().any(|(of, _)| of == *speaker)).map(|speaker| {
            let own = files.iter().filter(|(of, _)| of == speaker);
            let unit = |(number, (_, path)): (usize, &(String, PathBuf))| Unit {
                speaker: speaker.clone(),
                video: format!("excerpt-{number:02}"),
                source: path.clone(),
            };
            Videos { speaker: speaker.clone(), units: own.enumerate().map(unit).collect(), ..Videos::default() }
        });
        self.with(config, videos.collect())
    }
}
