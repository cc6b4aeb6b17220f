//! Status of a pipeline: the state of every unit at every stage, what a run would do, the time budget of every video.

use super::pipeline::Pipeline;
use super::stages;
use super::stale_results::{self, ModelStatus, StaleResult};
use super::time_budget::{TimeBudget, VideoProgress};
use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::record::DirtyReason;
use orator_base::stage::runner::State;
use orator_base::stage::workdir::FolderLock;
use orator_base::stage::{Stage, Unit, runner};
use orator_dataset::config::videos::Videos;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

#[derive(Clone, Debug, Default, Serialize)]
pub struct StatusReport {
    /// Status of every unit at every stage: the videos of a speaker, then the dataset of that speaker.
    pub units: Vec<UnitStatus>,
    /// What a run would do, one entry per stage.
    pub plan: Vec<StagePlan>,
    /// Time budget of every video, each speaker's total following the speaker's videos.
    pub time_budget: Vec<TimeBudget>,
    /// Total over all speakers.
    #[serde(skip)]
    pub total: TimeBudget,
    /// Models of the speakers that have a dataset.
    pub models: Vec<ModelStatus>,
    /// Datasets and models to rebuild.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stale: Vec<StaleResult>,
    /// Whether the seconds of every video add up to its duration.
    pub adds_up: bool,
}

/// State of a unit at a stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct UnitStatus {
    /// `speaker/video`; for a dataset, the speaker.
    pub unit: String,
    pub stage: StageName,
    /// State of the unit.
    pub state: UnitState,
    /// Reason why the unit is not up to date; otherwise the report line of the stage.
    pub reason: String,
}

/// State of a unit at a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum UnitState {
    /// A run would skip it.
    #[serde(rename = "fresh")]
    UpToDate,
    /// An input, a setting or the stage changed.
    Stale,
    /// The last attempt failed, and nothing it depends on has changed since.
    Failed,
    /// An earlier stage is not up to date.
    Waits,
    /// No attempt was made.
    #[serde(rename = "-")]
    NeverDone,
    /// A configuration entry matches no video; the unit is the speaker.
    #[serde(rename = "failed")]
    NoVideo,
}

/// What a run would do at one stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StagePlan {
    pub stage: StageName,
    pub up_to_date: usize,
    /// Number of units that would be processed.
    pub would_run: usize,
    /// Distinct reasons why these units are not up to date.
    pub reasons: BTreeSet<String>,
}

impl fmt::Display for UnitState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::UpToDate => "up to date",
            Self::Stale => "stale",
            Self::Failed | Self::NoVideo => "failed",
            Self::Waits => "waiting",
            Self::NeverDone => "-",
        })
    }
}

impl StatusReport {
    pub fn datasets_are_up_to_date(&self) -> bool {
        self.units.iter().all(|unit| unit.stage != StageName::Dataset || unit.state == UnitState::UpToDate)
    }
}

impl Pipeline {
    /// Status of the named speakers, or of all if `speakers` is empty. Writes nothing but the cache of file hashes.
    ///
    /// # Errors
    /// An unknown speaker; a video that is being deleted by `forget` (`BusyFolder`).
    pub fn status(&self, speakers: &[String]) -> Result<StatusReport> {
        let work = &self.config().settings.work.dir;
        let _lock = FolderLock::shared(work)?;
        let hashes = self.hashes();
        let (mut report, mut has_other_lifter) = (StatusReport::default(), BTreeMap::new());
        for videos in self.videos(speakers)? {
            report.units.extend(videos.missing.iter().map(|message| UnitStatus {
                unit: videos.speaker.clone(),
                stage: StageName::Extract,
                state: UnitState::NoVideo,
                reason: message.clone(),
            }));
            let ready = stages::ready(self.config(), &videos, &hashes).unwrap_or_default();
            let check = StatusCheck { pipeline: self, hashes: &hashes, videos: &videos, ready: &ready };
            let names = self.config().settings.stages_of(&videos.speaker).into_iter();
            let of_videos: Vec<_> = names.map(|name| (name, check.stage(name))).collect();
            let (mut speaker_waits_for, mut usable) = (None, Vec::new());
            let mut total = TimeBudget::of_speaker(&videos.speaker);
            for unit in &videos.units {
                let mut waits_for = None;
                let stage_statuses: Vec<UnitStatus> =
                    of_videos.iter().map(|(name, stage)| check.at(*name, stage, unit, &mut waits_for)).collect();
                // A dataset is built without the videos that failed, but waits for those that are still pending.
                let failed = stage_statuses.iter().find(|status| status.state == UnitState::Failed);
                usable.extend(failed.is_none().then(|| unit.clone()));
                speaker_waits_for = speaker_waits_for.or(waits_for.filter(|_| failed.is_none()));
                let video_progress = match (failed, waits_for) {
                    (Some(UnitStatus { stage, reason, .. }), _) => {
                        VideoProgress::Failed { stage: *stage, error: reason }
                    }
                    // The words do not change which seconds are accepted.
                    (None, None | Some(StageName::Transcribe)) => VideoProgress::Judged,
                    (None, Some(_)) => VideoProgress::Waiting,
                };
                let is_extracted = stage_statuses.first().is_some_and(|status| status.state == UnitState::UpToDate);
                let budget = TimeBudget::of_video(work, unit, video_progress, is_extracted);
                total.add(&budget);
                report.time_budget.push(budget);
                report.units.extend(stage_statuses);
            }
            let lift =
                of_videos.iter().find_map(|(name, stage)| stage.as_ref().ok().filter(|_| *name == StageName::Lift));
            // The dataset does not contain failed videos. Weights that cannot be read are a failure of the stage.
            let is_stale = lift
                .and_then(|lift| stale_results::has_other_lifter(&**lift, &usable, work, &hashes).ok())
                .unwrap_or(false);
            has_other_lifter.insert(videos.speaker.clone(), is_stale);
            report.total.add(&total);
            report.time_budget.push(total);
            let stage = check.stage(StageName::Dataset);
            for unit in stages::units(StageName::Dataset, self.config(), &videos) {
                report.units.push(check.at(StageName::Dataset, &stage, &unit, &mut speaker_waits_for));
            }
        }
        // Failing to save the hash cache only costs recomputation.
        hashes.save().unwrap_or_default();
        (report.stale, report.models) = stale_results::find(work, &has_other_lifter);
        report.plan = plan(&report.units);
        report.adds_up = report.total.n_mismatched == 0;
        Ok(report)
    }
}

struct StatusCheck<'a> {
    pipeline: &'a Pipeline,
    hashes: &'a HashCache,
    /// All videos of the speaker; `ready` are those that the dataset is built from.
    videos: &'a Videos,
    ready: &'a [Unit],
}

impl StatusCheck<'_> {
    fn stage(&self, name: StageName) -> Result<Box<dyn Stage>> {
        stages::build(name, self.pipeline.config(), std::slice::from_ref(self.videos), self.ready)
    }

    /// State of `unit` at a stage. `waits_for` is the first earlier stage not fresh; set to this stage if it is not.
    fn at(
        &self,
        name: StageName,
        stage: &Result<Box<dyn Stage>>,
        unit: &Unit,
        waits_for: &mut Option<StageName>,
    ) -> UnitStatus {
        let status = |state, reason| UnitStatus { unit: unit.to_string(), stage: name, state, reason };
        let stage = match stage {
            Ok(stage) => stage,
            Err(error) => return status(UnitState::Failed, format!("{error:#}")),
        };
        let state = match waits_for {
            Some(earlier) => State::Stale(DirtyReason::WaitsFor { stage: earlier.to_string() }),
            None => runner::state(&**stage, unit, &self.pipeline.config().settings.work.dir, self.hashes),
        };
        if !matches!(state, State::UpToDate(_)) {
            waits_for.get_or_insert(name);
        }
        match state {
            State::UpToDate(record) => status(UnitState::UpToDate, record.line),
            State::Stale(reason @ DirtyReason::NeverDone) => status(UnitState::NeverDone, reason.to_string()),
            State::Stale(reason @ DirtyReason::WaitsFor { .. }) => status(UnitState::Waits, reason.to_string()),
            State::Stale(reason) => status(UnitState::Stale, reason.to_string()),
            State::Failed(error) => status(UnitState::Failed, error),
        }
    }
}

fn plan(units: &[UnitStatus]) -> Vec<StagePlan> {
    let mut plan = BTreeMap::new();
    for UnitStatus { stage, state, reason, .. } in units.iter().filter(|unit| unit.state != UnitState::NoVideo) {
        let new = || StagePlan { stage: *stage, up_to_date: 0, would_run: 0, reasons: BTreeSet::new() };
        let line = plan.entry(*stage).or_insert_with(new);
        if *state == UnitState::UpToDate {
            line.up_to_date += 1;
        } else {
            line.would_run += 1;
            line.reasons.insert(reason.clone());
        }
    }
    plan.into_values().collect()
}
