//! Project of a viewer: its videos with their ledgers, and the state of every stage.

use crate::video::VideoView;
use anyhow::{Context, Result, ensure};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::rejection::Rejection;
use orator_dataset::config::Config;
use orator_dataset::config::videos::Videos;
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_pipeline::{Pipeline, UnitState};
use orator_report::videos::gather::VideoSummary;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Project of a configuration; videos, decisions and the work folder are read anew for every request.
pub struct Project {
    config: Config,
}

impl Project {
    /// # Errors
    /// Those of [`Pipeline::open`].
    pub fn open(config: Config) -> Result<Self> {
        Pipeline::open(config.clone())?;
        Ok(Self { config })
    }

    fn pipeline(&self) -> Result<Pipeline> {
        Pipeline::open(self.config.clone())
    }

    /// Work folder.
    pub fn work(&self) -> &Path {
        &self.config.settings.work.dir
    }

    /// Facts that do not change while the server runs.
    pub fn facts(&self) -> Value {
        let config = &self.config;
        let speakers: Vec<&str> = config.settings.speaker.iter().map(|speaker| speaker.name.as_str()).collect();
        let folder = config.file.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
        json!({ "title": folder, "config": config.file.display().to_string(), "speakers": speakers })
    }

    /// All videos with accepted and rejected seconds.
    ///
    /// # Errors
    /// Decisions that cannot be read.
    pub fn videos(&self) -> Result<Value> {
        let mut rows = Vec::new();
        for of_speaker in self.pipeline()?.videos(&[])? {
            for unit in &of_speaker.units {
                let video = VideoSummary::read(&self.config.settings, unit);
                let is_waiting = video.ledger.accepted.is_empty() && video.ledger.rejected.is_empty();
                let state = match (video.has_failed, is_waiting) {
                    (true, _) => "failed",
                    (false, true) => "waiting",
                    (false, false) => "done",
                };
                let mut rejected_secs: BTreeMap<String, f64> = BTreeMap::new();
                for (reason, secs) in video.ledger.rejected_secs() {
                    *rejected_secs.entry(Rejection::label(&reason).to_owned()).or_default() += secs;
                }
                rows.push(json!({
                    "id": id(unit), "speaker": unit.speaker, "name": unit.video, "file": video.file, "state": state,
                    "message": video.notes.join(" "), "duration_secs": video.ledger.duration_secs,
                    "accepted_secs": video.ledger.accepted_secs().abs(), "rejected_secs": rejected_secs,
                    "n_decisions": of_speaker.decisions.iter().filter(|one| one.video == unit.video).count(),
                }));
            }
        }
        Ok(json!({ "videos": rows }))
    }

    /// The video `SPEAKER/NAME`; `None` if the configuration has no such video.
    ///
    /// # Errors
    /// The videos cannot be listed.
    pub fn video(&self, speaker: &str, name: &str) -> Result<Option<VideoView>> {
        for mut of_speaker in self.pipeline()?.videos(&[])?.into_iter().filter(|of| of.speaker == speaker) {
            if let Some(unit) = of_speaker.units.iter().find(|unit| unit.video == name) {
                let transcripts: Vec<PathBuf> = of_speaker.transcripts.remove(name).unwrap_or_default();
                let decisions = of_speaker.decisions.iter().filter(|one| one.video == name).cloned().collect();
                return Ok(Some(VideoView::new(unit.clone(), &self.config.settings, transcripts, decisions)));
            }
        }
        Ok(None)
    }

    /// Stores a decision by `author` and returns its identifier.
    ///
    /// # Errors
    /// An invalid decision, one about an unknown video, or a file that cannot be written.
    pub fn decide(&self, request: DecisionRequest, author: &str) -> Result<Value> {
        let DecisionRequest { video, action, start_secs, end_secs, x, y, text } = request;
        let (speaker, name) = video.split_once('/').context("`video` is not SPEAKER/NAME")?;
        let is_known = |of: &Videos| of.speaker == speaker && of.units.iter().any(|unit| unit.video == name);
        ensure!(self.pipeline()?.videos(&[])?.iter().any(is_known), "the project has no video {video}");
        let (id, time) = (String::new(), String::new());
        let (speaker, video, author) = (speaker.to_owned(), name.to_owned(), author.to_owned());
        let decision = Decision { id, speaker, video, action, start_secs, end_secs, x, y, text, author, time };
        Ok(json!({ "id": decisions::add(&self.config.file, &decision)?.id }))
    }

    /// Removes the decision `id`; `false`: there is none.
    ///
    /// # Errors
    /// The file cannot be read or written.
    pub fn undo(&self, id: &str) -> Result<bool> {
        let config = &self.config.file;
        let is_known = decisions::read(config)?.iter().any(|one| one.id == id);
        if is_known {
            decisions::remove(config, id)?;
        }
        Ok(is_known)
    }

    /// File of the video `SPEAKER/NAME`; `None` for an unknown video and for one given as keypoints.
    ///
    /// # Errors
    /// The videos cannot be listed.
    pub fn film(&self, speaker: &str, name: &str) -> Result<Option<PathBuf>> {
        let videos = self.pipeline()?.videos(&[])?.into_iter().find(|of| of.speaker == speaker);
        let videos = videos.filter(|of| !of.keypoints.contains_key(name));
        let unit = videos.and_then(|of| of.units.into_iter().find(|unit| unit.video == name));
        Ok(unit.map(|unit| unit.source))
    }

    /// Number of videos by state at every stage, and the failures.
    ///
    /// # Errors
    /// A video that is being deleted.
    pub fn stages(&self) -> Result<Value> {
        let status = self.pipeline()?.status(&[])?;
        let count = |stage: StageName, states: &[UnitState]| {
            status.units.iter().filter(|unit| unit.stage == stage && states.contains(&unit.state)).count()
        };
        let stages = StageName::ALL.map(|stage| {
            json!({
                "name": stage,
                "done": count(stage, &[UnitState::UpToDate]),
                "stale": count(stage, &[UnitState::Stale, UnitState::NeverDone]),
                "failed": count(stage, &[UnitState::Failed, UnitState::NoVideo]),
                "waiting": count(stage, &[UnitState::Waits]),
            })
        });
        let has_failed = |state: UnitState| matches!(state, UnitState::Failed | UnitState::NoVideo);
        let failures = status.units.iter().filter(|unit| has_failed(unit.state));
        let failures = failures.map(|unit| json!({ "video": unit.unit, "stage": unit.stage, "message": unit.reason }));
        Ok(json!({ "stages": stages, "failures": failures.collect::<Vec<_>>() }))
    }
}

/// Decision as the page sends it; `video` is `SPEAKER/NAME`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DecisionRequest {
    video: String,
    action: DecisionAction,
    start_secs: f64,
    end_secs: f64,
    x: Option<f64>,
    y: Option<f64>,
    text: Option<String>,
}

/// Identifier of a video on the page: `SPEAKER/NAME`.
pub fn id(unit: &Unit) -> String {
    format!("{}/{}", unit.speaker, unit.video)
}
