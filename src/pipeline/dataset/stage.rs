//! Stage `dataset`: combines all videos of a speaker, as processed by the earlier stages, into one dataset. Unchanged
//! videos of an existing dataset are reused, so that adding a video costs only that video.

use super::division::{self, Division};
use super::outcome::{DatasetOutcome, SeveralPersons};
use super::persons::{self, VideoPerson};
use super::run::DatasetRun;
use super::video::{FILES, LiftedVideo, POSTURE_VERSION};
use anyhow::{Result, ensure};
use orator_base::stage::artifacts::{self, Artifact, StageName, dir, speaker_dir};
use orator_base::stage::ledger::{Ledger, longest_first};
use orator_base::stage::progress::Progress;
use orator_base::stage::record::Failure;
use orator_base::stage::{Input, Report, Stage, Unit};
use orator_base::text::{counted, length};
use orator_base::types::time::FrameRate;
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{self, Settings};
use orator_dataset::decisions::{self, Decision};
use orator_dataset::info::{About, ModelUsed};
use orator_dataset::split::{Assignment, Split, SplitBy, SplitRule};
use orator_dataset::write::assemble::DatasetWriter;
use orator_dataset::write::entry::{self, VideoSource};
use orator_formats::media_json::MediaInfo;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const OFFSET_NOTE: &str = "Where the lips showed surely that the sound of a video was late or early, it was shifted.";

/// Inputs of a dataset besides the settings.
#[derive(Default)]
pub struct DatasetInputs {
    /// Videos that passed the earlier stages, of one or several speakers.
    pub ready: Vec<Unit>,
    /// All videos, with the splits that the configuration names; the ledger lists those not in `ready` as failed.
    pub all: Vec<Videos>,
    /// Models that processed the videos, for `info.json`.
    pub models: Vec<ModelUsed>,
    /// Notes for users of the dataset.
    pub notes: Vec<String>,
    /// Keypoints within this many seconds of a frame affect its joints.
    pub context_secs: f64,
}

/// Stage `dataset`. Its unit is the speaker.
pub struct DatasetStage {
    settings: config::DatasetConfig,
    speakers: Vec<config::SpeakerConfig>,
    work: PathBuf,
    inputs: DatasetInputs,
    /// Whether a reliably measured audio offset is corrected.
    fixes_offset: bool,
    /// Guard interval between two splits of a video that is divided by time, frames.
    guard_frames: usize,
    fps: FrameRate,
    /// Least length of a sample of such a video, frames.
    window_frames: usize,
    /// State of the work folder at construction, by speaker.
    states: BTreeMap<String, SpeakerState>,
}

/// State of a speaker's videos in the work folder.
#[derive(Default)]
struct SpeakerState {
    /// Failures of the videos that are not ready, by name.
    others: BTreeMap<String, Option<String>>,
    /// Rule of the splits; `None` if the record is damaged, which a run reports as an error.
    rule: Option<SplitRule>,
}

impl DatasetStage {
    /// Creates the stage; reads failures and recorded splits from the work folder.
    pub fn new(settings: &Settings, mut inputs: DatasetInputs) -> Self {
        if settings.extract.fix_offset {
            inputs.notes.insert(0, OFFSET_NOTE.to_owned());
        }
        let mut stage = Self {
            settings: settings.dataset.clone(),
            speakers: settings.speaker.clone(),
            work: settings.work.dir.clone(),
            fixes_offset: settings.extract.fix_offset,
            guard_frames: division::guard_frames(settings, inputs.context_secs),
            fps: settings.extract.rate(),
            window_frames: division::window_frames(settings),
            states: BTreeMap::new(),
            inputs,
        };
        let speakers = stage.inputs.ready.iter().map(|video| video.speaker.clone());
        let speakers: BTreeSet<_> = speakers.chain(stage.inputs.all.iter().map(|all| all.speaker.clone())).collect();
        stage.states = speakers.into_iter().map(|speaker| (speaker.clone(), stage.state(speaker))).collect();
        stage
    }

    fn state(&self, speaker: String) -> SpeakerState {
        let unit = Unit { speaker, video: String::new(), source: PathBuf::new() };
        let others = self.failures(&unit, &self.ready(&unit));
        SpeakerState {
            others: others.into_iter().map(|source| (source.name, source.failure)).collect(),
            rule: self.division(&unit).ok().map(|division| division.rule(self.fps)),
        }
    }

    fn ready(&self, speaker: &Unit) -> Vec<&Unit> {
        let lifted = |video: &&Unit| Artifact::Joints.path(&self.work, video).exists();
        self.inputs.ready.iter().filter(|video| video.speaker == speaker.speaker).filter(lifted).collect()
    }

    fn videos(&self, speaker: &Unit) -> Option<&Videos> {
        self.inputs.all.iter().find(|videos| videos.speaker == speaker.speaker)
    }

    /// Source entries of the videos that did not pass all stages, with their failures.
    fn failures(&self, speaker: &Unit, ready: &[&Unit]) -> Vec<VideoSource> {
        let mut failed: Vec<&Unit> =
            self.inputs.ready.iter().filter(|video| video.speaker == speaker.speaker).collect();
        failed.extend(self.videos(speaker).into_iter().flat_map(|videos| &videos.units));
        failed.retain(|unit| !ready.contains(unit));
        failed.sort_by(|a, b| a.video.cmp(&b.video));
        failed.dedup();
        failed.into_iter().map(|unit| failure(&self.work, unit)).collect()
    }

    /// Persons in the speaker's videos; `None` if there is one.
    fn several_persons(&self, speaker: &Unit) -> Option<SeveralPersons> {
        let is_known =
            self.speakers.iter().any(|configured| configured.name == speaker.speaker && configured.same_person);
        let videos: Vec<&Unit> = if is_known { Vec::new() } else { self.ready(speaker) };
        let persons: Vec<VideoPerson> = videos.into_iter().map(|video| VideoPerson::read(&self.work, video)).collect();
        let groups = persons::groups(&persons);
        let files = |group: &Vec<&VideoPerson>| group.iter().map(|video| video.file.clone()).collect();
        (groups.len() > 1).then(|| SeveralPersons { videos: groups.iter().map(files).collect() })
    }

    /// Division of the speaker's videos: as recorded, else as configured.
    fn division(&self, speaker: &Unit) -> Result<Division> {
        let videos = self.videos(speaker);
        let n_videos = videos.map_or_else(|| self.ready(speaker).len(), |videos| videos.units.len());
        let are_named = videos.is_some_and(|videos| !videos.splits.is_empty());
        let before = division::recorded_splits(&self.work, speaker)?;
        let record = division::choose_record(self.settings.split_by, before, n_videos, are_named);
        Ok(Division { record, guard_frames: self.guard_frames, min_frames: self.window_frames })
    }

    /// Opens a video, with its words if the speaker has transcripts.
    fn open(&self, video: &Unit) -> Result<LiftedVideo> {
        let mut opened = LiftedVideo::open(&self.work, video, self.fixes_offset)?;
        opened = opened.with_decisions(self.decisions(&video.speaker));
        if self.settings.posture {
            opened = opened.with_posture();
        }
        let has_words = self
            .speakers
            .iter()
            .any(|configured| configured.name == video.speaker && !configured.transcripts.is_empty());
        Ok(if has_words { opened.with_words(self.transcripts(video)) } else { opened })
    }

    /// Decisions of users on the videos of a speaker.
    fn decisions(&self, speaker: &str) -> &[Decision] {
        let videos = self.inputs.all.iter().find(|videos| videos.speaker == speaker);
        videos.map(|videos| videos.decisions.as_slice()).unwrap_or_default()
    }

    /// Files that may be the transcript of a video.
    fn transcripts(&self, video: &Unit) -> &[PathBuf] {
        let videos = self.inputs.all.iter().find(|videos| videos.speaker == video.speaker);
        videos.and_then(|videos| videos.transcripts.get(&video.video)).map(Vec::as_slice).unwrap_or_default()
    }

    /// Models that processed the videos of a speaker: the recogniser only if it wrote the transcripts.
    fn models(&self, configured: &config::SpeakerConfig) -> Vec<ModelUsed> {
        let is_used = |model: &&ModelUsed| model.role != ModelUsed::WORDS || configured.transcribes();
        self.inputs.models.iter().filter(is_used).cloned().collect()
    }

    fn about(&self, speaker: &Unit, first: &LiftedVideo) -> About {
        let configured =
            self.speakers.iter().find(|configured| configured.name == speaker.speaker).cloned().unwrap_or_default();
        let mut models = self.models(&configured);
        let config::SpeakerConfig { licence, consent, source, .. } = configured;
        let ready = self.ready(speaker);
        let media = ready.iter().filter_map(|video| MediaInfo::read(&Artifact::MediaInfo.path(&self.work, video)).ok());
        let not_judged: Vec<String> = media.filter_map(|media| media.not_judged()).collect();
        let mut notes = self.inputs.notes.clone();
        if not_judged.len() == ready.len() {
            // Without pictures, only the models of speech were used.
            models.retain(|model| ["speech", ModelUsed::WORDS].contains(&model.role.as_str()));
        }
        let recogniser = models.iter().find(|model| model.role == ModelUsed::WORDS);
        notes.extend(
            recogniser.map(|model| format!("The words were recognised by {} (sha256 {}).", model.id, model.sha256)),
        );
        let kinds: BTreeSet<&String> = not_judged.iter().collect();
        let count = |kind: &str| not_judged.iter().filter(|other| *other == kind).count();
        notes.extend(kinds.into_iter().map(|kind| format!("{} made {kind}.", counted(count(kind), "video"))));
        let decided: Vec<&Decision> = self.decisions(&speaker.speaker).iter().collect();
        if !decided.is_empty() {
            notes.push(format!("Decided by hand: {}.", decisions::counts(&decided)));
        }
        About { models, licence, consent, source, notes, ..About::new(&speaker.speaker, first.intervals.fps) }
    }
}

/// Source entry of a video that failed at a stage or is unfinished.
fn failure(work: &Path, unit: &Unit) -> VideoSource {
    let failure = |stage: StageName| Some((stage.as_str(), Failure::read(&dir(work, stage, unit))?.error));
    let error = StageName::OF_VIDEOS.into_iter().find_map(failure);
    let (stage, error) = error.unwrap_or(("run", "not every stage is done".to_owned()));
    let duration_secs = MediaInfo::read(&Artifact::MediaInfo.path(work, unit)).ok().map(|media| media.duration_secs);
    let duration_secs = duration_secs.filter(|secs| *secs > 0.0);
    VideoSource {
        name: unit.video.clone(),
        file: unit.source.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        ledger: duration_secs.map_or_else(Ledger::default, |secs| Ledger::failed(secs, stage, &error)),
        failure: Some(format!("{stage}: {error}")),
        ..VideoSource::default()
    }
}

impl Stage for DatasetStage {
    fn name(&self) -> &'static str {
        StageName::Dataset.as_str()
    }

    fn version(&self) -> u32 {
        3
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        let configured =
            self.speakers.iter().find(|configured| configured.name == unit.speaker).cloned().unwrap_or_default();
        let videos = self.videos(unit);
        let no_state = SpeakerState::default();
        let SpeakerState { others, rule } = self.states.get(&unit.speaker).unwrap_or(&no_state);
        let guard_secs = rule.as_ref().map_or(0.0, |rule| rule.guard_secs);
        let mut settings = serde_json::json!({
            "unit": rule.as_ref().map(|rule| rule.unit), "guard_secs": guard_secs,
            "dataset": self.settings, "models": self.models(&configured), "notes": self.inputs.notes, "tool": env!("CARGO_PKG_VERSION"),
            "speaker": { "licence": configured.licence, "consent": configured.consent, "source": configured.source },
            "splits": videos.map(|videos| &videos.splits), "others": others,
        });
        if let (true, Some(settings)) = (self.fixes_offset, settings.as_object_mut()) {
            settings.insert("fix_offset".to_owned(), true.into());
        }
        // Without posture angles, the settings equal those of earlier versions, so that their datasets stay fresh.
        if self.settings.posture {
            settings["estimator"] = POSTURE_VERSION.into();
        } else {
            drop(settings["dataset"].as_object_mut().and_then(|dataset| dataset.shift_remove("posture")));
        }
        if let (false, Some(settings)) = (configured.transcripts.is_empty(), settings.as_object_mut()) {
            settings.insert("words".to_owned(), true.into());
        }
        if let (true, Some(settings)) = (configured.same_person, settings.as_object_mut()) {
            settings.insert("same_person".to_owned(), true.into());
        }
        decisions::record(&self.decisions(&unit.speaker).iter().collect::<Vec<_>>(), &mut settings);
        settings
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let mut inputs = Vec::new();
        for video in self.ready(unit) {
            inputs.push(Input { role: format!("{} video", video.video), path: video.source.clone() });
            for (path, nth) in self.transcripts(video).iter().zip(1..).filter(|(path, _)| path.is_file()) {
                let further = if nth > 1 { format!(" {nth}") } else { String::new() };
                inputs.push(Input { role: format!("{} transcript{further}", video.video), path: path.clone() });
            }
            let offset = self.fixes_offset.then_some((Artifact::SoundOffset, true));
            let portrait = Some((Artifact::Portrait, true));
            let media = MediaInfo::read(&Artifact::MediaInfo.path(&self.work, video));
            let moves_words =
                !self.transcripts(video).is_empty() && media.is_ok_and(|media| media.first_image_secs > 0.0);
            let media = moves_words.then_some((Artifact::MediaInfo, true));
            for (file, optional) in FILES.into_iter().chain(offset).chain(portrait).chain(media) {
                let path = file.path(&self.work, video);
                if !optional || path.exists() {
                    inputs.push(Input { role: format!("{} {}", video.video, file.file()), path });
                }
            }
        }
        Ok(inputs)
    }

    fn needs_folder_lock(&self) -> bool {
        true
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let ready = self.ready(unit);
        let failures = self.failures(unit, &ready);
        let mut videos = ready.into_iter().map(|video| self.open(video)).collect::<Result<Vec<_>>>()?;
        videos.sort_by(|a, b| (&a.name, &a.unit.video).cmp(&(&b.name, &b.unit.video)));
        check(unit, &self.work, &videos)?;

        let old = dir(&self.work, StageName::Dataset, unit);
        let mut division = self.division(unit)?;
        let mut run = DatasetRun::new(&self.settings, out, &old, progress);
        let (mut accepted, mut left_out): (Vec<&LiftedVideo>, Vec<(&LiftedVideo, VideoSource)>) =
            (Vec::new(), Vec::new());
        for video in &videos {
            match accepted.iter().find(|first| first.content == video.content) {
                Some(first) => left_out.push((video, run.duplicate(video, &first.name, video.ledger.duration_secs))),
                None => accepted.push(video),
            }
        }
        let sounds = run.sounds(&accepted)?;
        let compared = run.compare(&accepted, &sounds)?;
        let Some(first) = accepted.first() else { anyhow::bail!("no video of {unit} passed the earlier stages") };
        let fps = first.intervals.fps;
        let named =
            self.inputs.all.iter().flat_map(|videos| &videos.splits).map(|(video, split)| (video.as_str(), *split));
        let assigned = division.assign(&accepted, &named.collect(), &compared.shared, &self.settings);
        // The assignment is fixed from here on, even if the run stops before the dataset is complete.
        division.record.write(&artifacts::splits(&self.work, &unit.speaker))?;
        let rule = division.rule(fps);
        let about = About { split_rule: Some(rule.clone()), ..self.about(unit, first) };
        let writer = DatasetWriter::new(out, about, u64::from(self.settings.max_mb) << 20).with_compared(compared);
        let task = progress.begin(&format!("dataset {unit}"), accepted.len() as u64);
        for (video, assignment) in accepted.iter().zip(assigned) {
            task.detail(&video.name);
            match assignment {
                Assignment::Excluded(with) => {
                    entry::remove_sound(out, &video.name)?;
                    let secs = with.first().map_or(0.0, |shared| shared.secs);
                    let others: Vec<&str> = with.iter().filter_map(|shared| shared.other(&video.name)).collect();
                    left_out.push((video, run.duplicate(video, &others.join(" and "), secs)));
                }
                placed => run.write(&writer, video, placed, &division, &sounds)?,
            }
            task.advance(1);
        }
        let n_left_out = left_out.len();
        let empty = left_out.into_iter().map(|(_, source)| source).chain(failures.clone());
        for source in empty {
            writer.video(source, Split::Train, SplitBy::Share)?.finish(None)?;
        }
        let n_reused = run.n_reused;
        let (_, stats) = writer.finish()?;
        let several_persons = self.several_persons(unit);
        let outcome = DatasetOutcome {
            several_persons,
            settings: &self.settings,
            rule: &rule,
            videos: &videos,
            stats: &stats,
            n_failed: failures.len(),
            n_left_out,
            n_reused,
        };
        outcome.report(out)
    }
}

/// All footage of a speaker was rejected, so there is no dataset. The message lists the reasons.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NothingAccepted(pub String);

/// Checks that there is an accepted interval.
fn check(unit: &Unit, work: &Path, videos: &[LiftedVideo]) -> Result<()> {
    ensure!(
        !videos.is_empty(),
        "no dataset of {}: none of the videos passed the earlier stages; run `orator status --why` for the reasons",
        unit.speaker
    );
    let mut rejected: BTreeMap<String, f64> = BTreeMap::new();
    for (reason, secs) in videos.iter().flat_map(|video| video.ledger.rejected_secs()) {
        *rejected.entry(reason).or_default() += secs;
    }
    if videos.iter().any(|video| !video.intervals.intervals.is_empty()) {
        return Ok(());
    }
    let message = format!(
        "no dataset of {}: no interval was accepted in {} ({}); rejected: {}; see the {} of each video under {}",
        unit.speaker,
        counted(videos.len(), "video"),
        length(videos.iter().map(|video| video.ledger.duration_secs).sum()),
        longest_first(&rejected),
        Artifact::LiftLedger.file(),
        speaker_dir(work, StageName::Lift, &unit.speaker).display()
    );
    Err(NothingAccepted(message).into())
}
