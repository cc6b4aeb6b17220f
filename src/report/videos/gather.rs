//! Collection of all data of the report in a single pass over the videos. Only the summary of a video stays in memory,
//! with its ledger after the last completed stage, or the reason why there is none.

use super::distributions::MeasureCounts;
use super::gestures;
use super::movement::MovementCounts;
use super::sliders::{AcceptedByThreshold, JudgedVideo, open_frames};
use super::thresholds::THRESHOLDS;
use super::timelines::WAITING;
use super::worst::Worst;
use crate::preview::{MAX_PREVIEWS, MotionPreview};
use anyhow::{Context, Result, ensure};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::{Artifact, dir};
use orator_base::stage::ledger::{Ledger, WordCount};
use orator_base::stage::progress::Progress;
use orator_base::stage::record::Failure;
use orator_base::types::interval::Intervals;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use orator_dataset::decisions::Decision;
use orator_dataset::words::{self, VideoWords};
use orator_formats::media_json::MediaInfo;
use orator_formats::npz::Npz;
use orator_formats::{joints_npz, sound_offset_json};
use orator_gesture::phases::PhaseTotals;
use orator_pipeline::segment::Measures;
use std::path::{Path, PathBuf};

/// Letters of the words of an interval that are shown.
const MAX_LETTERS: usize = 300;

pub struct ReportData {
    pub videos: Vec<VideoSummary>,
    /// Accepted seconds by threshold (`sliders`) of each video; `None`: the video has no measures.
    pub accepted: Vec<Option<AcceptedByThreshold>>,
    pub measures: MeasureCounts,
    pub movement: MovementCounts,
    /// Gesture phases of the left and the right hand.
    pub hands: [PhaseTotals; 2],
    pub worst: Worst,
    /// Animated previews of the first videos with accepted motion.
    pub previews: Vec<MotionPreview>,
    /// Messages about entries of the configuration that have no effect.
    pub missing: Vec<String>,
    /// Number of videos to which the speech model was applied, and number of measured videos.
    pub n_speech_model: (usize, usize),
}

/// Collects the data of all `videos`, with at most `n_pictures` moments per rule.
pub fn gather(settings: &Settings, videos: &[Videos], n_pictures: usize, progress: &dyn Progress) -> ReportData {
    let missing = videos.iter().flat_map(|of| of.missing.iter().map(move |text| format!("{}: {text}", of.speaker)));
    let mut all = ReportData {
        videos: Vec::new(),
        accepted: Vec::new(),
        measures: MeasureCounts::new(),
        movement: MovementCounts::new(),
        hands: Default::default(),
        worst: Worst::new(n_pictures),
        previews: Vec::new(),
        missing: missing.collect(),
        n_speech_model: (0, 0),
    };
    let units: Vec<(&Videos, &Unit)> =
        videos.iter().flat_map(|of| of.units.iter().map(move |unit| (of, unit))).collect();
    let task = progress.begin("reading", units.len() as u64);
    for (of_speaker, unit) in units {
        task.detail(&unit.video);
        let mut video = VideoSummary::read(settings, unit);
        let transcripts = of_speaker.transcripts.get(&unit.video).map(Vec::as_slice).unwrap_or_default();
        let decided: Vec<&Decision> = of_speaker.decisions.iter().filter(|one| one.video == unit.video).collect();
        video.add_words(&settings.work.dir, transcripts, &decided);
        let accepted = if video.ledger.failed.is_empty() && video.ledger.duration_secs > 0.0 {
            all.add(settings, &mut video, &decided)
        } else {
            None
        };
        all.accepted.push(accepted);
        all.videos.push(video);
        task.advance(1);
    }
    all
}

impl ReportData {
    /// Adds the measures of a video; unreadable data becomes a note. Returns its accepted seconds by threshold.
    fn add(
        &mut self,
        settings: &Settings,
        video: &mut VideoSummary,
        decisions: &[&Decision],
    ) -> Option<AcceptedByThreshold> {
        let rules = &settings.segment;
        let (work, unit) = (&settings.work.dir, video.unit.clone());
        self.measures.add_intervals(&video.ledger);
        let (measures, judged) = match read_measures(work, &unit) {
            Ok(found) => found,
            Err(error) => {
                video.note(&format!("Not included in the histograms and sliders: {error:#}"));
                return None;
            }
        };
        self.n_speech_model.0 += usize::from(measures.speech.iter().any(|share| !share.is_nan()));
        self.n_speech_model.1 += 1;
        self.measures.add_frames(&measures);
        let bones = if video.is_lifted { bone_change(work, &unit) } else { Ok(Vec::new()) };
        let bone_change = bones.unwrap_or_else(|error| {
            video.note(&format!("{error:#}"));
            Vec::new()
        });
        self.measures.add_bones(&bone_change);
        self.worst.add(self.videos.len(), &video.ledger, (&measures, &bone_change), &judged, rules);
        if video.is_lifted {
            match motion(work, &unit) {
                Ok((motion, intervals)) => {
                    self.movement.add(&motion, &intervals.intervals);
                    gestures::add(&mut self.hands, &motion, &intervals.intervals);
                    if self.previews.len() < MAX_PREVIEWS {
                        let preview = MotionPreview::new(&video.file, video.anchor(), &motion, &intervals.intervals);
                        self.previews.extend(preview);
                    }
                }
                Err(error) => video.note(&format!("The motion is not shown: {error:#}")),
            }
        }
        let open = open_frames(&video.ledger, &judged);
        let max_bone_change = settings.lift.max_bone_change;
        let judged = JudgedVideo {
            measures: &measures,
            video: &judged,
            bone_change: &bone_change,
            max_bone_change,
            open: &open,
            decisions,
        };
        let now = judged.accepted_secs(rules);
        if (now - video.ledger.accepted_secs()).abs() > 1e-6 {
            video.note(
                "Thresholds or decisions have changed since this video was processed; the sliders start at the new \
                 values. Run `orator run` to update it.",
            );
        }
        let accepted = judged.table(rules);
        debug_assert_eq!(accepted.len(), THRESHOLDS.len());
        Some(accepted)
    }
}

fn read_measures(work: &Path, unit: &Unit) -> Result<(Measures, MediaInfo)> {
    let judged = MediaInfo::read(&Artifact::MediaInfo.path(work, unit))?;
    let measures = Measures::read(&Artifact::Measures.path(work, unit))?;
    ensure!(
        measures.n_frames() == judged.n_frames,
        "the measures have {} frames, the video has {}: run the segment stage again",
        measures.n_frames(),
        judged.n_frames
    );
    Ok((measures, judged))
}

fn bone_change(work: &Path, unit: &Unit) -> Result<Vec<f32>> {
    let values = Npz::open(&Artifact::BoneChange.path(work, unit))?.floats("bone_change", &[None])?;
    Ok(values.into_iter().collect())
}

/// Joints of a lifted video, and its accepted intervals.
///
/// # Errors
/// A file of the stage is missing or unreadable.
pub fn motion(work: &Path, unit: &Unit) -> Result<(orator_base::types::pose3d::Motion, Intervals)> {
    let path = Artifact::LiftIntervals.path(work, unit);
    let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let intervals =
        serde_json::from_slice(&bytes).with_context(|| format!("{} is not a list of intervals", path.display()))?;
    Ok((joints_npz::read(&Artifact::Joints.path(work, unit))?, intervals))
}

#[derive(Clone, Debug)]
pub struct VideoSummary {
    pub unit: Unit,
    pub file: String,
    /// Ledger of the video; empty if its length is unknown.
    pub ledger: Ledger,
    pub is_lifted: bool,
    pub has_failed: bool,
    /// Numbers of words in the transcript; `None`: it has none.
    pub words: Option<WordCount>,
    /// Start of each interval of the ledger in seconds, sorted, and the words in it.
    spoken: Vec<(f64, String)>,
    /// Notes on missing data and on properties of the file, a sentence each.
    pub notes: Vec<String>,
    /// Local folder names and their replacements on the page.
    folders: [(String, &'static str); 2],
}

impl VideoSummary {
    /// Reads the state of `unit` from the work folder; unreadable data becomes a note.
    pub fn read(settings: &Settings, unit: &Unit) -> Self {
        let work: &Path = &settings.work.dir;
        let file = unit.source.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let folders = [(work, "work"), (unit.source.parent().unwrap_or(work), "")];
        let folders = folders.map(|(folder, name)| (folder.display().to_string(), name));
        let mut video = Self {
            unit: unit.clone(),
            file,
            ledger: Ledger::default(),
            is_lifted: false,
            has_failed: false,
            words: None,
            spoken: Vec::new(),
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
        let failure = settings
            .stages_of(&unit.speaker)
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

    /// Words of the first usable one of the files `transcripts`, corrected by `decisions`; `None`: there is no such file.
    pub fn video_words(&self, work: &Path, transcripts: &[PathBuf], decisions: &[&Decision]) -> Option<VideoWords> {
        if !transcripts.iter().any(|path| path.is_file()) {
            return None;
        }
        let media = MediaInfo::read(&Artifact::MediaInfo.path(work, &self.unit)).ok();
        let start_secs = media.as_ref().map_or(0.0, |media| media.first_image_secs);
        let audio_secs = media.and_then(|media| media.audio_secs).unwrap_or(self.ledger.duration_secs);
        let end_secs = start_secs + audio_secs;
        let choice = words::choose(transcripts, &self.unit.speaker, end_secs);
        Some(VideoWords::of(choice, transcripts, end_secs, start_secs).corrected(decisions))
    }

    fn add_words(&mut self, work: &Path, transcripts: &[PathBuf], decisions: &[&Decision]) {
        let Some(words) = self.video_words(work, transcripts, decisions) else { return };
        let accepted = self.ledger.accepted.iter().map(|accepted| (accepted.start_secs, accepted.end_secs));
        let rejected = self.ledger.rejected.iter().map(|rejected| (rejected.start_secs, rejected.end_secs));
        let spoken = |(start, end): (f64, f64)| {
            let words: Vec<String> = words.within(start, end).into_iter().map(|word| word.word).collect();
            let text = words.join(" ");
            let is_long = text.chars().nth(MAX_LETTERS).is_some();
            let shown: String = text.chars().take(MAX_LETTERS).collect();
            (start, if is_long { format!("{shown} ...") } else { shown })
        };
        self.words = Some(words.report(accepted.clone()).count);
        self.spoken = accepted.chain(rejected).map(spoken).collect();
        self.spoken.sort_by(|a, b| a.0.total_cmp(&b.0));
    }

    /// Words in the interval of the ledger that begins at `start_secs`.
    pub fn spoken(&self, start_secs: f64) -> &str {
        let found = self.spoken.binary_search_by(|(start, _)| start.total_cmp(&start_secs));
        found.ok().and_then(|at| self.spoken.get(at)).map_or("", |(_, text)| text)
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
