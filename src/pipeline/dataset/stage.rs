//! The stage: all videos of a speaker, as `extract`, `pose2d`, `segment` and `lift` left them, become one dataset.
//! What the dataset that was there has of a video already is taken over as it is, so that a new video costs itself alone.

use super::outcome::DatasetOutcome;
use super::video::{FILES, LiftedVideo};
use crate::config;
use crate::config::Settings;
use crate::config::videos::Videos;
use crate::dataset::info::{About, ModelUsed};
use crate::dataset::leakage::SoundComparison;
use crate::dataset::shared_sound;
use crate::dataset::split::SplitBy;
use crate::dataset::split::{Assignment, Split, Unassigned, assign};
use crate::dataset::write::part;
use crate::dataset::write::part::{VideoEntry, VideoSource};
use crate::dataset::write::writer::DatasetWriter;
use crate::formats::media_json::MediaInfo;
use crate::stage::artifacts::{Artifact, StageName, dir, speaker_dir};
use crate::stage::ledger::{Ledger, Refused, longest_first};
use crate::stage::progress::Progress;
use crate::stage::record::Failure;
use crate::stage::refusal::{FrameRefusal, Refusal};
use crate::stage::{Input, Report, Stage, Unit, counted};
use anyhow::{Result, ensure};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A speaker's videos to shards. Its unit is the speaker.
pub struct DatasetStage {
    settings: config::DatasetConfig,
    speakers: Vec<config::SpeakerConfig>,
    work: PathBuf,
    /// Videos that came through the stages before.
    ready: Vec<Unit>,
    /// All videos of all speakers, with the splits that the configuration names.
    all: Vec<Videos>,
    models: Vec<ModelUsed>,
}

impl DatasetStage {
    /// `ready` are the units of videos that came through the stages before, of one speaker or of several.
    pub fn new(settings: &Settings, ready: &[Unit]) -> Self {
        Self {
            settings: settings.dataset.clone(),
            speakers: settings.speaker.clone(),
            work: settings.work.dir.to_path_buf(),
            ready: ready.to_vec(),
            all: Vec::new(),
            models: Vec::new(),
        }
    }

    /// Names all videos there are: those not ready stand in the ledger as failed.
    pub fn with_videos(self, all: Vec<Videos>) -> Self {
        Self { all, ..self }
    }

    /// Names the models that looked at the videos in `info.json`.
    pub fn with_models(self, models: Vec<ModelUsed>) -> Self {
        Self { models, ..self }
    }

    fn ready(&self, speaker: &Unit) -> Vec<&Unit> {
        let lifted = |video: &&Unit| Artifact::Joints.path(&self.work, video).exists();
        self.ready.iter().filter(|video| video.speaker == speaker.speaker).filter(lifted).collect()
    }

    fn videos(&self, speaker: &Unit) -> Option<&Videos> {
        self.all.iter().find(|videos| videos.speaker == speaker.speaker)
    }

    /// The videos of which nothing can come, as parts with their failures.
    fn failures(&self, speaker: &Unit, ready: &[&Unit]) -> Vec<VideoSource> {
        let mut failed: Vec<&Unit> = self.ready.iter().filter(|video| video.speaker == speaker.speaker).collect();
        failed.extend(self.videos(speaker).into_iter().flat_map(|videos| &videos.units));
        failed.retain(|unit| !ready.contains(unit));
        failed.sort_by(|a, b| a.video.cmp(&b.video));
        failed.dedup();
        failed.into_iter().map(|unit| failure(&self.work, unit)).collect()
    }

    fn about(&self, speaker: &Unit, first: &LiftedVideo) -> About {
        let said = self.speakers.iter().find(|said| said.name == speaker.speaker).cloned().unwrap_or_default();
        let config::SpeakerConfig { licence, consent, source, .. } = said;
        let models = self.models.clone();
        About { models, licence, consent, source, ..About::new(&speaker.speaker, first.intervals.fps) }
    }
}

/// A video that failed at a stage, or that no stage has finished.
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
        2
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        let said = self.speakers.iter().find(|said| said.name == unit.speaker).cloned().unwrap_or_default();
        let videos = self.videos(unit);
        // What became of the videos that are not ready stands in the ledger.
        let others = self.failures(unit, &self.ready(unit));
        let others: BTreeMap<String, Option<String>> = others.into_iter().map(|s| (s.name, s.failure)).collect();
        serde_json::json!({
            "dataset": self.settings, "models": self.models, "tool": env!("CARGO_PKG_VERSION"),
            "speaker": { "licence": said.licence, "consent": said.consent, "source": said.source },
            "splits": videos.map(|videos| &videos.splits), "others": others,
        })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let mut inputs = Vec::new();
        for video in self.ready(unit) {
            inputs.push(Input { role: format!("{} video", video.video), path: video.source.clone() });
            for (file, optional) in FILES {
                let path = file.path(&self.work, video);
                if !optional || path.exists() {
                    inputs.push(Input { role: format!("{} {}", video.video, file.file()), path });
                }
            }
        }
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let ready = self.ready(unit);
        let failures = self.failures(unit, &ready);
        let mut videos =
            ready.into_iter().map(|video| LiftedVideo::open(&self.work, video)).collect::<Result<Vec<_>>>()?;
        videos.sort_by(|a, b| (&a.name, &a.unit.video).cmp(&(&b.name, &b.unit.video)));
        check(unit, &self.work, &videos)?;

        let old = dir(&self.work, StageName::Dataset, unit);
        let mut run = DatasetRun { stage: self, out, old: &old, before: parts_of(&old), n_taken_over: 0, progress };
        let (mut kept, mut left_out): (Vec<&LiftedVideo>, Vec<(&LiftedVideo, VideoSource)>) = (Vec::new(), Vec::new());
        for video in &videos {
            match kept.iter().find(|first| first.content == video.content) {
                Some(first) => left_out.push((video, run.duplicate(video, &first.name, video.ledger.duration_secs))),
                None => kept.push(video),
            }
        }
        let sounds = run.sounds(&kept)?;
        let compared = run.compare(&kept, &sounds)?;
        let assigned = run.assign(&kept, &compared);
        let Some(first) = kept.first() else { anyhow::bail!("no video of {unit} is ready") };
        let writer = DatasetWriter::new(out, self.about(unit, first), u64::from(self.settings.max_mb) << 20)
            .with_compared(compared);
        let task = progress.begin(&format!("dataset {unit}"), kept.len() as u64);
        for (video, assignment) in kept.iter().zip(assigned) {
            task.detail(&video.name);
            match assignment {
                Assignment::In(split, by) => run.write(&writer, video, split, by, &sounds)?,
                Assignment::Nowhere(with) => {
                    part::remove_sound(out, &video.name)?;
                    let secs = with.first().map_or(0.0, |shared| shared.secs);
                    let others: Vec<&str> = with.iter().filter_map(|shared| shared.other(&video.name)).collect();
                    left_out.push((video, run.duplicate(video, &others.join(" and "), secs)));
                }
            }
            task.advance(1);
        }
        let n_left_out = left_out.len();
        let empty = left_out.into_iter().map(|(_, source)| source).chain(failures.clone());
        for source in empty {
            writer.video(source, Split::Train, SplitBy::Content)?.finish(None)?;
        }
        let n_taken_over = run.n_taken_over;
        let (_, stats) = writer.finish()?;
        let outcome = DatasetOutcome {
            settings: &self.settings,
            videos: &videos,
            stats: &stats,
            n_failed: failures.len(),
            n_left_out,
            n_taken_over,
        };
        outcome.report(out)
    }
}

/// All that a speaker shows was refused, so that there is nothing to make a dataset of. The message has the reasons.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NothingKept(pub String);

/// The videos must have something to make a dataset of.
fn check(unit: &Unit, work: &Path, videos: &[LiftedVideo]) -> Result<()> {
    ensure!(
        !videos.is_empty(),
        "none of the videos of {} came through the stages before, so there is no dataset; \
         `orator status --why` says where each stands",
        unit.speaker
    );
    let mut refused: BTreeMap<String, f64> = BTreeMap::new();
    for (reason, secs) in videos.iter().flat_map(|video| video.ledger.refused_secs()) {
        *refused.entry(reason).or_default() += secs;
    }
    if videos.iter().any(|video| !video.intervals.intervals.is_empty()) {
        return Ok(());
    }
    let message = format!(
        "no interval worth keeping in {} of {:.1} s, so there is no dataset of {}; refused: {}; \
         the {} of each video under {} says where and why",
        counted(videos.len(), "video"),
        videos.iter().map(|video| video.ledger.duration_secs).sum::<f64>(),
        unit.speaker,
        longest_first(&refused),
        Artifact::LiftLedger.file(),
        speaker_dir(work, StageName::Lift, &unit.speaker).display()
    );
    Err(NothingKept(message).into())
}

/// The videos of the dataset that is there; one with a damaged file is as good as not there.
fn parts_of(dir: &Path) -> BTreeMap<String, VideoEntry> {
    let stated = part::stated_hashes(dir);
    let parts = part::names(dir).unwrap_or_default().into_iter();
    let parts = parts.filter_map(|name| VideoEntry::read(&VideoEntry::path(dir, &name)).ok().map(|part| (name, part)));
    parts.filter(|(_, part)| part.is_sound(dir, &stated)).collect()
}

/// Hashes of the codes of the videos that have sound.
type Sounds = BTreeMap<String, String>;

/// What is at hand while a dataset is written.
struct DatasetRun<'a> {
    stage: &'a DatasetStage,
    out: &'a Path,
    /// The dataset that is there, and its videos.
    old: &'a Path,
    before: BTreeMap<String, VideoEntry>,
    n_taken_over: usize,
    progress: &'a dyn Progress,
}

impl DatasetRun<'_> {
    /// Writes the codes of each video's sound, the old dataset's where the content is the same; their hashes.
    fn sounds(&self, videos: &[&LiftedVideo]) -> Result<Sounds> {
        let task = self.progress.begin("sound", videos.len() as u64);
        let mut hashes = Sounds::new();
        for video in videos {
            let before = self.before.get(&video.name).filter(|part| part.content == video.content);
            let codes = match before.map(|part| part.codes(self.old)) {
                Some(Ok(codes)) if !codes.is_empty() => Some(codes),
                _ => video.sound_codes()?,
            };
            if let Some(codes) = codes {
                hashes.insert(video.name.clone(), part::write_sound(self.out, &video.name, &codes)?);
            }
            task.advance(1);
        }
        Ok(hashes)
    }

    fn compare(&self, videos: &[&LiftedVideo], sounds: &Sounds) -> Result<SoundComparison> {
        let duplicate_secs = self.stage.settings.duplicate_secs;
        if duplicate_secs <= 0.0 {
            return Ok(SoundComparison::default());
        }
        let audible = videos.iter().filter(|v| !v.intervals.intervals.is_empty() && sounds.contains_key(&v.name));
        let names: Vec<String> = audible.map(|video| video.name.clone()).collect();
        let shared = shared_sound::find(&names, |n| part::read_sound(self.out, &names[n]), duplicate_secs)?;
        Ok(SoundComparison { duplicate_secs, shared })
    }

    fn assign(&self, videos: &[&LiftedVideo], compared: &SoundComparison) -> Vec<Assignment> {
        let named: BTreeMap<&str, Split> = self
            .stage
            .all
            .iter()
            .flat_map(|videos| videos.splits.iter().map(|(video, split)| (video.as_str(), *split)))
            .collect();
        let waiting = videos.iter().map(|video| Unassigned {
            name: &video.name,
            content: &video.content,
            named: named.get(video.unit.video.as_str()).copied(),
            before: self.before.get(&video.name).filter(|part| part.split.is_some()).map(|part| &part.split_by),
        });
        let waiting: Vec<Unassigned> = waiting.collect();
        assign(&waiting, &compared.shared, self.stage.settings.validation, self.stage.settings.test)
    }

    /// Writes a video, or takes it over from the old dataset.
    fn write(
        &mut self,
        writer: &DatasetWriter,
        video: &LiftedVideo,
        split: Split,
        by: SplitBy,
        sounds: &Sounds,
    ) -> Result<()> {
        let made_from = serde_json::json!([
            crate::dataset::SCHEMA,
            video.file,
            video.files_hash,
            split,
            by,
            self.stage.settings.max_mb
        ]);
        let made_from = blake3::hash(made_from.to_string().as_bytes()).to_hex().to_string();
        let same = self.before.get(&video.name).filter(|part| part.made_from == made_from);
        if let Some(part) = same {
            self.n_taken_over += 1;
            return part.take_over(self.old, self.out);
        }
        let source = VideoSource {
            name: video.name.clone(),
            file: video.file.clone(),
            content: video.content.clone(),
            made_from,
            ledger: video.ledger.clone(),
            bones: video.bones.clone(),
            failure: None,
        };
        let mut part = writer.video(source, split, by)?;
        if !video.intervals.intervals.is_empty() {
            let mut samples = video.samples()?;
            while let Some(cut) = samples.next_sample()? {
                part.push(&cut.sample, cut.padded_secs)?;
            }
        }
        part.finish(sounds.get(&video.name).cloned())?;
        Ok(())
    }

    /// A video that is left out, since what it shows is there already: what was kept of it is refused.
    fn duplicate(&self, video: &LiftedVideo, of: &str, secs: f64) -> VideoSource {
        let threshold = self.stage.settings.duplicate_secs;
        let mut ledger = video.ledger.clone();
        let why = FrameRefusal::new(Refusal::Duplicate, secs, threshold);
        let refused = ledger.kept.drain(..).map(|kept| {
            Refused::with_message(kept.start_secs, kept.end_secs, why, format!("the same {secs:.1} s are in {of}"))
        });
        let refused: Vec<Refused> = refused.collect();
        ledger.refused.extend(refused);
        ledger.refused.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        let (name, file, content) = (video.unit.video.clone(), video.file.clone(), video.content.clone());
        VideoSource { name, file, content, ledger, ..VideoSource::default() }
    }
}
