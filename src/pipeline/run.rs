//! Running the pipeline or a part of it: the per-video stages, video by video, then the datasets of the speakers.

use super::pipeline::Pipeline;
use super::pose2d::models;
use super::speech::speech_rule::SpeechDetector;
use super::stages::{self, HookedStage, UnitWork};
use super::timing::{StageClock, StageTime};
use anyhow::{Context, Result, ensure};
use orator_base::stage::artifacts::{StageName, speaker_dir};
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::{Event, Progress};
use orator_base::stage::runner::StageOutcome;
use orator_base::stage::{Stage, Unit, runner, workdir};
use orator_dataset::config::videos::Videos;
use orator_onnx::ModelStore;
use serde::Serialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Part of the pipeline to run; by default every stage for every speaker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    /// First stage, inclusive.
    pub from: StageName,
    /// Last stage, inclusive.
    pub to: StageName,
    /// Names of the speakers; all if empty.
    pub speakers: Vec<String>,
    /// Number of videos processed in parallel; 0: one per processor core; `None`: `work.jobs` of the configuration.
    pub jobs: Option<usize>,
    /// Whether fresh units are processed again.
    pub force: bool,
}

impl Default for Selection {
    fn default() -> Self {
        let [from, .., to] = StageName::ALL;
        Self { from, to, speakers: Vec::new(), jobs: None, force: false }
    }
}

impl Selection {
    /// Selects one stage, for every speaker.
    pub fn only(stage: StageName) -> Self {
        Self { from: stage, to: stage, ..Self::default() }
    }

    pub fn has(&self, stage: StageName) -> bool {
        (self.from..=self.to).contains(&stage)
    }
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct RunReport {
    /// Number of units per stage and outcome.
    pub stages: BTreeMap<StageName, StageCounts>,
    /// Failed units and configuration entries without a video; they do not stop the other units.
    pub failures: Vec<UnitFailure>,
    /// Units that were processed or already fresh.
    pub units: Vec<UnitReport>,
    /// Folders of the datasets that are complete.
    pub datasets: Vec<PathBuf>,
    /// Processing time of each stage and unit.
    #[serde(skip)]
    pub times: Vec<StageTime>,
    /// Number of selected speakers.
    #[serde(skip)]
    pub n_speakers: usize,
}

/// Number of units of a stage by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StageCounts {
    /// Processed in this run.
    pub done: usize,
    /// Already up to date.
    pub up_to_date: usize,
    pub failed: usize,
}

/// A unit that failed at a stage, or a configuration entry that matches no video.
#[derive(Clone, Debug, Serialize)]
pub struct UnitFailure {
    /// The speaker, for a configuration entry that matches no video.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speaker: Option<String>,
    /// The unit: `speaker/video`; for a dataset, the speaker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    pub stage: StageName,
    /// Error message with its causes.
    pub error: String,
    /// The error itself, for `downcast_ref`: `UnreadableMedia`, `NothingAccepted`, `NoSpace`, `ModelError`.
    #[serde(skip)]
    pub cause: Option<Arc<anyhow::Error>>,
}

/// A unit that is fresh at a stage after the run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnitReport {
    /// `speaker/video`; for a dataset, the speaker.
    pub unit: String,
    pub stage: StageName,
    /// Whether this run processed the unit.
    pub state: RunState,
    /// Summary line of the stage.
    pub line: String,
    /// Statistics of the stage.
    pub facts: Map<String, Value>,
}

/// Keys of the statistics in records of earlier versions, and their present names.
const OLD_KEYS: [(&str, &str); 3] =
    [("kept_secs", "accepted_secs"), ("refused_secs", "rejected_secs"), ("several_people", "several_persons")];

/// Renames the old keys of statistics.
fn with_present_keys(mut facts: Map<String, Value>) -> Map<String, Value> {
    for (old, present) in OLD_KEYS {
        let value = facts.shift_remove(old);
        facts.extend(value.map(|value| (present.to_owned(), value)));
    }
    facts
}

/// Whether this run processed a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    /// Processed in this run.
    Done,
    #[serde(rename = "fresh")]
    UpToDate,
}

impl Pipeline {
    /// Runs the selected stages. Fresh units are skipped; a unit that fails does not stop the others.
    ///
    /// # Errors
    /// Errors that stop the complete run: an unknown speaker, a missing model, another run in the same work folder
    /// (`BusyFolder`), a work folder that cannot be written.
    pub fn run(&self, selection: &Selection, progress: &dyn Progress) -> Result<RunReport> {
        let Selection { from, to, force, .. } = *selection;
        ensure!(from <= to, "--from {from} comes after --to {to}");
        let mut remaining = self.videos(&selection.speakers)?;
        let settings = &self.config().settings;
        if selection.has(StageName::Pose2d) && remaining.iter().any(Videos::has_video_files) {
            let note = stages::check_models(settings)?;
            note.iter().for_each(|line| progress.event(&Event::Advice { line }));
        }
        let transcribes = remaining.iter().any(|videos| settings.transcribes(&videos.speaker));
        ensure!(
            transcribes || (from, to) != (StageName::Transcribe, StageName::Transcribe),
            "no words are to be recognised: set `transcripts = \"auto\"` under [[speaker]]"
        );
        let is_selected = |name: &StageName| selection.has(*name) && (transcribes || *name != StageName::Transcribe);
        // Missing weights or manifest entries are reported before hours of work, not after.
        for name in StageName::ALL.into_iter().filter(is_selected) {
            stages::build(name, self.config(), self.all_videos(), &[])?;
        }
        let _lock = workdir::lock(&settings.work.dir).context(
            "cannot start the run; another work folder can be set as `dir` under [work] in pipeline.toml or with \
                 --set work.dir=FOLDER",
        )?;
        for videos in &remaining {
            // An interrupted replacement of a dataset is undone now, since its record is read before that stage runs.
            workdir::recover_folder(&speaker_dir(&settings.work.dir, StageName::Dataset, &videos.speaker))?;
        }
        // Stage outputs and the work folder's own files are at most two folders deep.
        workdir::sweep_folder(&settings.work.dir, 2);
        let jobs = self.jobs(selection.jobs);
        if let Some(line) = SpeechDetector::advice(settings)?.filter(|_| selection.has(StageName::Segment)) {
            progress.event(&Event::Advice { line });
        }
        let advice = models::advice(&settings.pose2d, &ModelStore::open(&settings.models.dir)?);
        if let Some(line) = advice.filter(|_| selection.has(StageName::Pose2d)) {
            progress.event(&Event::Advice { line });
        }
        let report = RunReport { n_speakers: remaining.len(), ..RunReport::default() };
        let hashes = self.hashes();
        let mut run = StageRun { pipeline: self, hashes: &hashes, limits: (jobs, force), progress, report };
        for videos in &remaining {
            for error in &videos.missing {
                progress.event(&Event::NoVideo { speaker: &videos.speaker, error });
                run.report.failures.push(UnitFailure {
                    speaker: Some(videos.speaker.clone()),
                    unit: None,
                    stage: StageName::Extract,
                    error: error.clone(),
                    cause: None,
                });
            }
        }
        // Not every speaker's words are recognised, so this stage has its own units.
        let (transcribe, names): (Vec<_>, Vec<_>) =
            StageName::OF_VIDEOS.into_iter().filter(is_selected).partition(|name| *name == StageName::Transcribe);
        run.stages(&names, &[], &mut remaining)?;
        run.stages(&transcribe, &[], &mut remaining)?;
        if selection.has(StageName::Dataset) {
            let ready = run.ready(&remaining)?;
            let failed = run.stages(&[StageName::Dataset], &ready, &mut remaining)?;
            let complete = remaining.iter().map(|videos| &videos.speaker).filter(|speaker| !failed.contains(speaker));
            run.report.datasets =
                complete.map(|speaker| speaker_dir(&settings.work.dir, StageName::Dataset, speaker)).collect();
        }
        Ok(run.report)
    }
}

struct StageRun<'a> {
    pipeline: &'a Pipeline,
    hashes: &'a HashCache,
    /// Number of workers, and whether fresh units are processed again.
    limits: (usize, bool),
    progress: &'a dyn Progress,
    report: RunReport,
}

impl StageRun<'_> {
    /// Runs stages that have the same units, for all `remaining` videos. A failed unit is removed from `remaining`.
    /// Returns the speakers of the failed units.
    fn stages(&mut self, names: &[StageName], ready: &[Unit], remaining: &mut [Videos]) -> Result<Vec<String>> {
        let Some(&first) = names.first() else { return Ok(Vec::new()) };
        let config = self.pipeline.config();
        let units: Vec<Unit> = remaining.iter().flat_map(|videos| stages::units(first, config, videos)).collect();
        let work = &config.settings.work.dir;
        let clock = StageClock::default();
        let hook = |stage: &'static str, unit: &Unit, work: UnitWork<'_>| clock.time(stage, unit, work);
        let hooked = |name: &StageName| Ok(HookedStage { stage: self.pipeline.stage(*name, ready)?, hook: &hook });
        let stages = names.iter().map(hooked).collect::<Result<Vec<_>>>()?;
        let stages: Vec<&dyn Stage> = stages.iter().map(|stage| stage as &dyn Stage).collect();
        let all_outcomes = runner::run_stages(&stages, &units, work, self.hashes, self.limits, self.progress);
        self.report.times.extend(clock.take());
        self.hashes.save()?;
        for name in names {
            self.report.stages.entry(*name).or_default();
        }
        let mut failed = Vec::new();
        for (unit, outcomes) in units.iter().zip(all_outcomes) {
            for (&stage, outcome) in names.iter().zip(outcomes) {
                let counts = self.report.stages.entry(stage).or_default();
                let (count, state) = match &outcome {
                    StageOutcome::Done(_) => (&mut counts.done, RunState::Done),
                    StageOutcome::Skipped(_) => (&mut counts.up_to_date, RunState::UpToDate),
                    StageOutcome::Failed(_) => (&mut counts.failed, RunState::Done),
                };
                *count += 1;
                match outcome {
                    StageOutcome::Done(report) | StageOutcome::Skipped(report) => {
                        let (unit, line, facts) = (unit.to_string(), report.line, with_present_keys(report.facts));
                        self.report.units.push(UnitReport { unit, stage, state, line, facts });
                    }
                    StageOutcome::Failed(error) => {
                        failed.push(unit.speaker.clone());
                        self.report.failures.push(UnitFailure {
                            speaker: None,
                            unit: Some(unit.to_string()),
                            stage,
                            error: format!("{error:#}"),
                            cause: Some(error),
                        });
                        for videos in remaining.iter_mut().filter(|videos| videos.speaker == unit.speaker) {
                            videos.units.retain(|other| other != unit);
                        }
                    }
                }
            }
        }
        Ok(failed)
    }

    /// Videos that the datasets are built from. A video with an earlier stage that is not fresh is left out, reported
    /// as an event and recorded as a failure.
    fn ready(&mut self, remaining: &[Videos]) -> Result<Vec<Unit>> {
        let mut all_ready = Vec::new();
        for videos in remaining {
            let ready = stages::ready(self.pipeline.config(), videos, self.hashes)?;
            for unit in videos.units.iter().filter(|unit| !ready.contains(unit)) {
                self.progress.event(&Event::LeftOut { unit: &unit.to_string() });
                self.report.failures.push(UnitFailure {
                    speaker: None,
                    unit: Some(unit.to_string()),
                    stage: StageName::Dataset,
                    error: "left out of the dataset: an earlier stage is not up to date".to_owned(),
                    cause: None,
                });
            }
            all_ready.extend(ready);
        }
        Ok(all_ready)
    }
}
