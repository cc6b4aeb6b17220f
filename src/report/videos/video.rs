//! State of a video in the report: its ledger after the last completed stage, or the reason why there is none.

use super::reasons::WAITING;
use orator_base::stage::Unit;
use orator_base::stage::artifacts::{Artifact, StageName, dir};
use orator_base::stage::ledger::Ledger;
use orator_base::stage::record::Failure;
use orator_formats::media_json::MediaInfo;
use orator_formats::sound_offset_json;
use std::path::Path;

/// Summary of a video in the report.
#[derive(Clone, Debug)]
pub struct VideoSummary {
    pub unit: Unit,
    /// File name.
    pub file: String,
    /// Ledger of the video; empty if its length is unknown.
    pub ledger: Ledger,
    /// Whether the lift stage has finished.
    pub is_lifted: bool,
    /// Whether a stage failed.
    pub has_failed: bool,
    /// Notes on missing data and on properties of the file, a sentence each.
    pub notes: Vec<String>,
    /// Local folder names and their replacements on the page.
    folders: [(String, &'static str); 2],
}

impl VideoSummary {
    /// Reads the state of `unit` from the folder `work`; unreadable data becomes a note.
    pub fn read(work: &Path, unit: &Unit) -> Self {
        let file = unit.source.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let folders = [(work, "work"), (unit.source.parent().unwrap_or(work), "")];
        let folders = folders.map(|(folder, name)| (folder.display().to_string(), name));
        let mut video = Self {
            unit: unit.clone(),
            file,
            ledger: Ledger::default(),
            is_lifted: false,
            has_failed: false,
            notes: Vec::new(),
            folders,
        };
        if !unit.source.exists() {
            video.note("The video file is missing: no pictures available.");
        }
        if let Ok(media) = MediaInfo::read(&Artifact::MediaInfo.path(work, unit)) {
            media.notes().iter().for_each(|remark| video.note(&format!("File: {remark}.")));
            if let Some(reason) = media.not_judged() {
                video.note(&format!("Created {reason}."));
            }
        }
        if let Some(offset) = sound_offset_json::read(&Artifact::SoundOffset.path(work, unit)).ok().flatten()
            && offset.is_reportable()
        {
            video.note(&format!("Measured by lip sync: the {offset}."));
        }
        let failure = StageName::OF_VIDEOS
            .into_iter()
            .find_map(|stage| Some((stage, Failure::read(&dir(work, stage, unit))?.error)));
        if let Some((stage, error)) = failure {
            video.mark_unavailable(work, stage.as_str(), &error);
            return video;
        }
        for file in [Artifact::LiftLedger, Artifact::SegmentLedger] {
            let path = file.path(work, unit);
            if !path.exists() {
                continue;
            }
            match Ledger::read(&path) {
                Ok(ledger) => {
                    (video.ledger, video.is_lifted) = (ledger, file == Artifact::LiftLedger);
                    if !video.is_lifted {
                        video.note("Not lifted yet: the rules on bones have not been applied.");
                    }
                    return video;
                }
                Err(error) => video.note(&format!("{error:#}")),
            }
        }
        video.mark_unavailable(work, WAITING, "not processed yet: run `orator run`");
        video
    }

    /// Marks all seconds as failed in `stage` or, for `WAITING`, as not processed yet.
    fn mark_unavailable(&mut self, work: &Path, stage: &str, error: &str) {
        let media = MediaInfo::read(&Artifact::MediaInfo.path(work, &self.unit));
        let secs = media.ok().map(|media| media.duration_secs).filter(|secs| *secs > 0.0);
        self.ledger = secs.map_or_else(Ledger::default, |secs| Ledger::failed(secs, stage, error));
        self.has_failed = stage != WAITING;
        match stage {
            WAITING => self.note("Not processed yet: run `orator run`."),
            _ => self.note(&format!("The stage {stage} failed: {error}")),
        }
        if secs.is_none() {
            self.note("The length is unknown; the video is not included in the totals.");
        }
    }

    /// Adds a note with local folder names replaced.
    pub fn note(&mut self, text: &str) {
        let text = self.folders.iter().fold(text.to_owned(), |text, (folder, name)| {
            if name.is_empty() { text.replace(&format!("{folder}/"), "") } else { text.replace(folder, name) }
        });
        self.notes.push(text);
    }

    /// Anchor of the video's timeline on the page.
    pub fn anchor(&self) -> String {
        format!("video-{}-{}", self.unit.speaker, self.unit.video)
    }
}
