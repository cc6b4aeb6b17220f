//! How long stages take: the time of every unit that a run works on, and the same pipeline on excerpts of its videos.

use super::pipeline::Pipeline;
use super::process::message::MediaRequest;
use super::process::{answer_media, ask_media};
use super::stages::UnitWork;
use anyhow::Result;
use orator_base::stage::artifacts::{self, StageName};
use orator_base::stage::parts::folder_of_parts;
use orator_base::stage::{Report, Unit};
use orator_dataset::config::videos::Videos;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// How long a stage worked on a unit.
#[derive(Clone, Debug, PartialEq)]
pub struct StageTime {
    pub stage: StageName,
    pub unit: Unit,
    pub secs: f64,
    /// Whether the unit had been begun before: what was done of it then is not in `secs`.
    pub is_rest: bool,
}

/// Takes the times of units.
pub struct StageClock {
    /// Units that had a folder of parts before the clock began.
    begun: BTreeSet<(StageName, Unit)>,
    times: Mutex<Vec<StageTime>>,
}

impl StageClock {
    /// A clock for `stages` of `units`, whose folders are in `work`.
    pub fn new(work: &Path, stages: &[StageName], units: &[Unit]) -> Self {
        let all = stages.iter().flat_map(|stage| units.iter().map(move |unit| (*stage, unit.clone())));
        let has_parts =
            |(stage, unit): &(StageName, Unit)| folder_of_parts(&artifacts::dir(work, *stage, unit)).is_dir();
        Self { begun: all.filter(has_parts).collect(), times: Mutex::default() }
    }

    /// Does the work on a unit; that of one that fails is timed too.
    pub fn time(&self, stage: &str, unit: &Unit, work: UnitWork) -> Result<Report> {
        let start = Instant::now();
        let report = work();
        if let Ok(stage) = stage.parse() {
            let secs = start.elapsed().as_secs_f64();
            let is_rest = self.begun.contains(&(stage, unit.clone()));
            let time = StageTime { stage, unit: unit.clone(), secs, is_rest };
            self.times.lock().unwrap_or_else(PoisonError::into_inner).push(time);
        }
        report
    }

    /// The times, in the order in which the work ended; the clock begins anew.
    pub fn take(&self) -> Vec<StageTime> {
        std::mem::take(&mut *self.times.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Pipeline {
    /// The length of a video in seconds, where a header says it, or what was copied of it: see `answer_media`. The video is
    /// read in a process of its own where the pipeline has a program for it.
    ///
    /// # Errors
    /// A video that cannot be read.
    pub fn ask_media(&self, request: &MediaRequest) -> Result<Option<f64>> {
        match self.program() {
            Some(program) => ask_media(program, request),
            None => answer_media(request),
        }
    }

    /// This pipeline with these files, each with the name of its speaker, in place of all videos, and another work
    /// folder.
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
