//! A run of the pipeline, or of a part of it: the stages of videos, video by video, then the datasets of the speakers.

use super::pipeline::Pipeline;
use super::pose2d::models;
use super::segment::speech_rule::SpeechDetector;
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

/// The part of the pipeline to run; by default every stage for every speaker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    /// First stage.
    pub from: StageName,
    /// Last stage.
    pub to: StageName,
    /// Names of speakers; empty: all.
    pub speakers: Vec<String>,
    /// Videos worked on side by side, 0: one a processor core; none: `work.jobs` of the configuration.
    pub jobs: Option<usize>,
    /// Whether fresh units are worked on again.
    pub force: bool,
}

impl Default for Selection {
    fn default() -> Self {
        let [from, .., to] = StageName::ALL;
        Self { from, to, speakers: Vec::new(), jobs: None, force: false }
    }
}

impl Selection {
    /// One stage alone, for every speaker.
    pub fn only(stage: StageName) -> Self {
        Self { from: stage, to: stage, ..Self::default() }
    }

    /// Whether the stage is one of those to run.
    pub fn has(&self, stage: StageName) -> bool {
        (self.from..=self.to).contains(&stage)
    }
}

/// How a run ended.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RunReport {
    /// Units of each stage by how they ended.
    pub stages: BTreeMap<StageName, StageCounts>,
    /// What failed; the rest is done.
    pub failures: Vec<UnitFailure>,
    /// What is done or was fresh.
    pub units: Vec<UnitReport>,
    /// Folders of the datasets that stand.
    pub datasets: Vec<PathBuf>,
    /// How long each stage worked on each unit.
    #[serde(skip)]
    pub times: Vec<StageTime>,
    /// Number of speakers chosen.
    #[serde(skip)]
    pub n_speakers: usize,
}

/// Units of a stage by how they ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StageCounts {
    /// Worked on.
    pub done: usize,
    /// Fresh already.
    pub fresh: usize,
    /// Failed.
    pub failed: usize,
}

/// A unit that failed at a stage, or a speaker with an entry that leads to no video.
#[derive(Clone, Debug, Serialize)]
pub struct UnitFailure {
    /// The speaker, where an entry of the configuration leads to no video.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speaker: Option<String>,
    /// The unit: `speaker/video`, or `speaker` of a dataset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Where it failed.
    pub stage: StageName,
    /// With its causes, for people.
    pub error: String,
    /// To be matched by `downcast_ref`: `UnreadableMedia`, `NothingKept`, `NoSpace`, `ModelError`.
    #[serde(skip)]
    pub cause: Option<Arc<anyhow::Error>>,
}

/// A unit that is fresh at a stage now.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnitReport {
    /// `speaker/video`, or `speaker` of a dataset.
    pub unit: String,
    /// The stage.
    pub stage: StageName,
    /// Whether this run did it.
    pub state: RunState,
    /// The stage's line for people.
    pub line: String,
    /// The stage's numbers.
    pub facts: Map<String, Value>,
}

/// Whether a unit was worked on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    /// Worked on.
    Done,
    /// Fresh already.
    Fresh,
}

impl Pipeline {
    /// Runs the chosen stages; fresh units are skipped, a unit that fails does not stop the others.
    ///
    /// # Errors
    /// What stops the whole run: an unknown speaker, a missing model, another run in the same work folder
    /// (`BusyFolder`), a work folder that cannot be written.
    pub fn run(&self, selection: &Selection, progress: &dyn Progress) -> Result<RunReport> {
        let Selection { from, to, force, .. } = *selection;
        ensure!(from <= to, "--from {from} comes after --to {to}");
        let mut alive = self.videos(&selection.speakers)?;
        let settings = &self.config().settings;
        if selection.has(StageName::Pose2d) && alive.iter().any(Videos::has_video_files) {
            stages::check_models(settings)?;
        }
        // What a stage needs (weights, the manifest) is looked at before hours of work, not after.
        for name in StageName::ALL.into_iter().filter(|name| selection.has(*name)) {
            stages::build(name, self.config(), self.all_videos(), &[])?;
        }
        let _lock = workdir::lock(&settings.work.dir)
            .context("no run now; another folder is chosen with --set work.dir=FOLDER")?;
        for videos in &alive {
            // What is on record of a dataset counts before its turn comes.
            workdir::recover_folder(&speaker_dir(&settings.work.dir, StageName::Dataset, &videos.speaker))?;
        }
        // Files of the stages and of the work folder lie two folders deep.
        workdir::sweep_folder(&settings.work.dir, 2);
        let jobs = self.jobs(selection.jobs);
        if let Some(line) = SpeechDetector::advice(settings)?.filter(|_| selection.has(StageName::Segment)) {
            progress.event(&Event::Advice { line });
        }
        let advice = models::advice(&settings.pose2d, &ModelStore::open(&settings.models.dir)?);
        if let Some(line) = advice.filter(|_| selection.has(StageName::Pose2d)) {
            progress.event(&Event::Advice { line });
        }
        let report = RunReport { n_speakers: alive.len(), ..RunReport::default() };
        let hashes = self.hashes();
        let mut run = StageRun { pipeline: self, hashes: &hashes, limits: (jobs, force), progress, report };
        for videos in &alive {
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
        let names: Vec<StageName> = StageName::OF_VIDEOS.into_iter().filter(|name| selection.has(*name)).collect();
        run.stages(&names, &[], &mut alive)?;
        if selection.has(StageName::Dataset) {
            let ready = run.ready(&alive)?;
            let failed = run.stages(&[StageName::Dataset], &ready, &mut alive)?;
            let stand = alive.iter().map(|videos| &videos.speaker).filter(|speaker| !failed.contains(speaker));
            run.report.datasets =
                stand.map(|speaker| speaker_dir(&settings.work.dir, StageName::Dataset, speaker)).collect();
        }
        Ok(run.report)
    }
}

struct StageRun<'a> {
    pipeline: &'a Pipeline,
    hashes: &'a HashCache,
    /// Workers, and whether fresh units are worked on again.
    limits: (usize, bool),
    progress: &'a dyn Progress,
    report: RunReport,
}

impl StageRun<'_> {
    /// Runs stages that have the same units, for everything alive; what fails is not alive for later ones. Gives the
    /// speakers of what failed.
    fn stages(&mut self, names: &[StageName], ready: &[Unit], alive: &mut [Videos]) -> Result<Vec<String>> {
        let Some(&first) = names.first() else { return Ok(Vec::new()) };
        let config = self.pipeline.config();
        let units: Vec<Unit> = alive.iter().flat_map(|videos| stages::units(first, config, videos)).collect();
        let work = &config.settings.work.dir;
        let clock = StageClock::default();
        let hook = |stage: &'static str, unit: &Unit, work: UnitWork<'_>| clock.time(stage, unit, work);
        let timed = |name: &StageName| Ok(HookedStage { stage: self.pipeline.stage(*name, ready)?, hook: &hook });
        let stages = names.iter().map(timed).collect::<Result<Vec<_>>>()?;
        let stages: Vec<&dyn Stage> = stages.iter().map(|stage| stage as &dyn Stage).collect();
        let ended = runner::run_stages(&stages, &units, work, self.hashes, self.limits, self.progress);
        self.report.times.extend(clock.take());
        self.hashes.save()?;
        for name in names {
            self.report.stages.entry(*name).or_default();
        }
        let mut failed = Vec::new();
        for (unit, answers) in units.iter().zip(ended) {
            for (&stage, answer) in names.iter().zip(answers) {
                let counts = self.report.stages.entry(stage).or_default();
                let (count, state) = match &answer {
                    StageOutcome::Done(_) => (&mut counts.done, RunState::Done),
                    StageOutcome::Skipped(_) => (&mut counts.fresh, RunState::Fresh),
                    StageOutcome::Failed(_) => (&mut counts.failed, RunState::Done),
                };
                *count += 1;
                match answer {
                    StageOutcome::Done(report) | StageOutcome::Skipped(report) => {
                        let (unit, line, facts) = (unit.to_string(), report.line, report.facts);
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
                        for videos in alive.iter_mut().filter(|videos| videos.speaker == unit.speaker) {
                            videos.units.retain(|alive| alive != unit);
                        }
                    }
                }
            }
        }
        Ok(failed)
    }

    /// The videos the datasets are made of. Each that is left out, as a stage before is not up to date, is an event and a
    /// failure of the run.
    fn ready(&mut self, alive: &[Videos]) -> Result<Vec<Unit>> {
        let mut all_ready = Vec::new();
        for videos in alive {
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
