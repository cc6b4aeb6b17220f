//! How every unit stands at every stage, what a run would do, and what became of every second.

use super::account::{Standing, TimeAccount};
use super::pipeline::Pipeline;
use super::stages;
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

/// How a pipeline stands.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StatusReport {
    /// Every unit at every stage: the videos of a speaker, then its dataset.
    pub units: Vec<UnitStatus>,
    /// What a run would do, a line a stage.
    pub plan: Vec<StagePlan>,
    /// The seconds of every video, then of its speaker.
    pub account: Vec<TimeAccount>,
    /// The seconds of all speakers.
    #[serde(skip)]
    pub total: TimeAccount,
    /// Whether the seconds of every video add up to its duration.
    pub adds_up: bool,
}

/// How a unit stands at a stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct UnitStatus {
    /// `speaker/video`, or `speaker` of a dataset.
    pub unit: String,
    /// The stage.
    pub stage: StageName,
    /// The word for it.
    pub state: UnitState,
    /// Why it is not fresh; of a fresh unit the stage's line.
    pub why: String,
}

/// How a unit stands, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum UnitState {
    /// A run would skip it.
    Fresh,
    /// An input, a setting or the stage changed.
    Stale,
    /// The last attempt failed, with what is there now.
    Failed,
    /// An earlier stage is not fresh.
    Waits,
    /// No attempt was made.
    #[serde(rename = "-")]
    NeverDone,
    /// An entry of the configuration leads to no video; the unit is the speaker.
    #[serde(rename = "failed")]
    NoVideo,
}

/// What a run would do at a stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StagePlan {
    /// The stage.
    pub stage: StageName,
    /// Units that are fresh.
    pub stay_fresh: usize,
    /// Units that are not.
    pub would_run: usize,
    /// Why they are not, each reason once.
    pub because: BTreeSet<String>,
}

impl fmt::Display for UnitState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Fresh => "up to date",
            Self::Stale => "stale",
            Self::Failed | Self::NoVideo => "failed",
            Self::Waits => "waits",
            Self::NeverDone => "-",
        })
    }
}

impl StatusReport {
    /// Whether every dataset is fresh.
    pub fn datasets_are_fresh(&self) -> bool {
        self.units.iter().all(|unit| unit.stage != StageName::Dataset || unit.state == UnitState::Fresh)
    }
}

impl Pipeline {
    /// How the speakers of those names stand; all where none is named. Only the table of known hashes is written.
    ///
    /// # Errors
    /// An unknown speaker; a video that is being forgotten now (`BusyFolder`).
    pub fn status(&self, speakers: &[String]) -> Result<StatusReport> {
        let _lock = FolderLock::shared(&self.config().settings.work.dir)?;
        let hashes = self.hashes();
        let mut report = StatusReport::default();
        for videos in self.videos(speakers)? {
            report.units.extend(videos.missing.iter().map(|message| UnitStatus {
                unit: videos.speaker.clone(),
                stage: StageName::Extract,
                state: UnitState::NoVideo,
                why: message.clone(),
            }));
            let ready = stages::ready(self.config(), &videos, &hashes).unwrap_or_default();
            let check = StatusCheck { pipeline: self, hashes: &hashes, videos: &videos, ready: &ready };
            let of_videos = StageName::OF_VIDEOS.map(|name| (name, check.stage(name)));
            let mut speaker_waits_for = None;
            let mut total = TimeAccount::of_speaker(&videos.speaker);
            for unit in &videos.units {
                let mut waits_for = None;
                let at_stages: Vec<UnitStatus> =
                    of_videos.iter().map(|(name, stage)| check.at(*name, stage, unit, &mut waits_for)).collect();
                // The dataset is made without a video that failed; it waits for those that can still come.
                let failed = at_stages.iter().find(|status| status.state == UnitState::Failed);
                speaker_waits_for = speaker_waits_for.or(waits_for.filter(|_| failed.is_none()));
                let standing = match (failed, waits_for) {
                    (Some(UnitStatus { stage, why, .. }), _) => Standing::Failed { stage: *stage, error: why },
                    (None, Some(_)) => Standing::Waiting,
                    (None, None) => Standing::Judged,
                };
                let is_extracted = at_stages.first().is_some_and(|status| status.state == UnitState::Fresh);
                let work = &self.config().settings.work.dir;
                let account = TimeAccount::of_video(work, unit, standing, is_extracted);
                total.add(&account);
                report.account.push(account);
                report.units.extend(at_stages);
            }
            report.total.add(&total);
            report.account.push(total);
            let stage = check.stage(StageName::Dataset);
            for unit in stages::units(StageName::Dataset, self.config(), &videos) {
                report.units.push(check.at(StageName::Dataset, &stage, &unit, &mut speaker_waits_for));
            }
        }
        // Hashes that cannot be kept are computed again.
        hashes.save().unwrap_or_default();
        report.plan = plan(&report.units);
        report.adds_up = report.total.n_wrong == 0;
        Ok(report)
    }

    /// What became of every second of every video, and of every speaker after its videos.
    ///
    /// # Errors
    /// An unknown speaker.
    pub fn account(&self, speakers: &[String]) -> Result<Vec<TimeAccount>> {
        Ok(self.status(speakers)?.account)
    }
}

struct StatusCheck<'a> {
    pipeline: &'a Pipeline,
    hashes: &'a HashCache,
    /// All videos of the speaker, and those the dataset is made of.
    videos: &'a Videos,
    ready: &'a [Unit],
}

impl StatusCheck<'_> {
    fn stage(&self, name: StageName) -> Result<Box<dyn Stage>> {
        stages::build(name, self.pipeline.config(), std::slice::from_ref(self.videos), self.ready)
    }

    /// How `unit` stands at a stage, given the first stage before it that is not fresh.
    fn at(
        &self,
        name: StageName,
        stage: &Result<Box<dyn Stage>>,
        unit: &Unit,
        waits_for: &mut Option<StageName>,
    ) -> UnitStatus {
        let status = |state, why| UnitStatus { unit: unit.to_string(), stage: name, state, why };
        let stage = match stage {
            Ok(stage) => stage,
            Err(error) => return status(UnitState::Failed, format!("{error:#}")),
        };
        let state = match waits_for {
            Some(earlier) => State::Stale(DirtyReason::WaitsFor { stage: earlier.to_string() }),
            None => runner::state(&**stage, unit, &self.pipeline.config().settings.work.dir, self.hashes),
        };
        if !matches!(state, State::Fresh(_)) {
            waits_for.get_or_insert(name);
        }
        match state {
            State::Fresh(record) => status(UnitState::Fresh, record.line),
            State::Stale(why @ DirtyReason::NeverDone) => status(UnitState::NeverDone, why.to_string()),
            State::Stale(why @ DirtyReason::WaitsFor { .. }) => status(UnitState::Waits, why.to_string()),
            State::Stale(why) => status(UnitState::Stale, why.to_string()),
            State::Failed(error) => status(UnitState::Failed, error),
        }
    }
}

fn plan(units: &[UnitStatus]) -> Vec<StagePlan> {
    let mut plan = BTreeMap::new();
    for UnitStatus { stage, state, why, .. } in units.iter().filter(|unit| unit.state != UnitState::NoVideo) {
        let new = || StagePlan { stage: *stage, stay_fresh: 0, would_run: 0, because: BTreeSet::new() };
        let line = plan.entry(*stage).or_insert_with(new);
        if *state == UnitState::Fresh {
            line.stay_fresh += 1;
        } else {
            line.would_run += 1;
            line.because.insert(why.clone());
        }
    }
    plan.into_values().collect()
}
