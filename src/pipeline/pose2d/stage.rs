//! Stage `pose2d`: processes the spans of a video independently and joins them into `keypoints.npz` and the portrait.

use super::chain::Chain;
use super::chosen_person::ChosenPerson;
use super::models::{self, ChosenModels, check_follow};
use super::span::video_frames::VideoFrames;
use super::span::{PoseSpan, pass};
use super::talker::TalkerSearch;
use anyhow::{Context, Result};
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::stage::progress::Progress;
use orator_base::stage::{Input, Report, Stage, Unit};
use orator_base::types::device::DeviceChoice;
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_dataset::config::{FollowRule, Settings, to_stored};
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_formats::media_json::MediaInfo;
use orator_formats::timeline_npz::Timeline;
use orator_media::ffmpeg;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::opencv;
use orator_onnx::{ModelEntry, ModelError, Runtime};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Stage `pose2d`.
pub struct Pose2dStage {
    chosen: ChosenModels,
    models: config::ModelsConfig,
    fps: FrameRate,
    work: PathBuf,
    /// Reference picture by name of the speaker.
    references: BTreeMap<String, PathBuf>,
    /// Version of ONNX Runtime, or `missing`.
    onnxruntime: String,
    on_gpu: bool,
    /// Decisions of users on any videos.
    decisions: Vec<Decision>,
}

impl Pose2dStage {
    /// Loads ONNX Runtime if it is installed; opens no model.
    ///
    /// # Errors
    /// Those of `ChosenModels::find`; `follow = "speaking"` without the models that it needs.
    pub fn new(settings: &Settings) -> Result<Self> {
        let named = settings.speaker.iter().filter(|speaker| !speaker.reference.as_os_str().is_empty());
        let references = named.map(|speaker| (speaker.name.clone(), speaker.reference.clone())).collect();
        let models = settings.models.clone();
        let chosen = ChosenModels::find(settings)?;
        check_follow(&chosen.settings)?;
        let runtime = Runtime::load(&models.onnxruntime, &models.dir);
        let on_gpu = match models.provider {
            DeviceChoice::Auto => models::runtime(&models).is_ok_and(|(runtime, _)| runtime.inference.is_some()),
            provider => provider != DeviceChoice::Cpu,
        };
        let onnxruntime = runtime.map_or_else(|_| "missing".to_owned(), |runtime| runtime.version());
        let (fps, work) = (settings.extract.rate(), settings.work.dir.clone());
        Ok(Self { chosen, models, fps, work, references, onnxruntime, on_gpu, decisions: Vec::new() })
    }

    pub fn with_decisions(self, decisions: Vec<Decision>) -> Self {
        Self { decisions, ..self }
    }

    /// Decisions on whom to follow in a video.
    fn choices(&self, unit: &Unit) -> Vec<&Decision> {
        decisions::of_unit(&self.decisions, unit, &[DecisionAction::Speaker])
    }

    fn runtime(&self) -> Result<Runtime> {
        Ok(models::runtime(&self.models)?.0)
    }
}

impl Stage for Pose2dStage {
    fn name(&self) -> &'static str {
        StageName::Pose2d.as_str()
    }

    fn version(&self) -> u32 {
        11
    }

    fn cost(&self) -> u32 {
        40
    }

    fn settings(&self, unit: &Unit) -> Value {
        let read = |entry: &ModelEntry| {
            json!({
                "id": entry.id, "picture": entry.picture, "fit": entry.fit,
                "decode": entry.decode, "points": entry.points, "sha256": entry.sha256,
            })
        };
        let models: serde_json::Map<String, Value> = self
            .chosen
            .used()
            .unwrap_or_default()
            .into_iter()
            .map(|(key, entry)| (key.to_owned(), read(entry)))
            .collect();
        let mut pose2d = to_stored(StageName::Pose2d.as_str(), &self.chosen.settings).unwrap_or_default();
        // `follow = "largest"` is left out, so that the output of versions without this setting stays fresh.
        if let Some(keys) = pose2d.as_object_mut().filter(|_| !self.follows_talker()) {
            keys.remove("follow");
        }
        let mut settings = json!({
            "pose2d": pose2d,
            "fps": [self.fps.num, self.fps.den],
            "models": models,
            "onnxruntime": self.onnxruntime,
            "opencv": opencv::version(),
            "ffmpeg": ffmpeg::version(),
        });
        // The CPU is left out, so that the output of versions without this setting stays fresh.
        if self.on_gpu {
            settings["provider"] = json!("cuda");
        }
        decisions::record(&self.choices(unit), &mut settings);
        settings
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: String, path: PathBuf| Input { role, path };
        let mut inputs = vec![
            input("video".into(), unit.source.clone()),
            input("timeline".into(), Artifact::Timeline.path(&self.work, unit)),
            input("media".into(), Artifact::MediaInfo.path(&self.work, unit)),
        ];
        if let Some(path) = self.references.get(&unit.speaker) {
            inputs.push(input("reference".into(), path.clone()));
        }
        let sound = Artifact::Sound.path(&self.work, unit);
        if self.follows_talker() && sound.exists() {
            inputs.push(input("sound".into(), sound));
        }
        for (key, entry) in self.chosen.used()? {
            let path = self.models.dir.join(&entry.file);
            if !path.exists() {
                return Err(ModelError::Missing { id: entry.id.clone(), path }.into());
            }
            inputs.push(input(format!("model:{key}"), path));
        }
        Ok(inputs)
    }

    fn n_parts(&self, unit: &Unit) -> Result<usize> {
        Ok(self.timeline(unit)?.spans().len())
    }

    /// Processes one span of the video.
    fn run_part(&self, unit: &Unit, part: usize, out: &Path, progress: &dyn Progress) -> Result<()> {
        let timeline = self.timeline(unit)?;
        let span = timeline.spans().into_iter().nth(part).with_context(|| format!("part {part} does not exist"))?;
        self.process_span(unit, &timeline, span, progress)?.write(out)
    }

    fn join(&self, unit: &Unit, parts: &[PathBuf], out: &Path) -> Result<Report> {
        let mut joined = PoseSpan::default();
        for (part, span) in parts.iter().zip(self.timeline(unit)?.spans()) {
            joined.append(PoseSpan::read(part, span.len())?);
        }
        joined.finish(self.fps, out)
    }

    /// Processes all spans in order.
    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let timeline = self.timeline(unit)?;
        let mut joined = PoseSpan::default();
        for span in timeline.spans() {
            joined.append(self.process_span(unit, &timeline, span, progress)?);
        }
        joined.finish(self.fps, out)
    }
}

impl Pose2dStage {
    fn follows_talker(&self) -> bool {
        self.chosen.settings.follow == FollowRule::Speaking
    }

    fn timeline(&self, unit: &Unit) -> Result<Timeline> {
        Timeline::read(&Artifact::Timeline.path(&self.work, unit))
    }

    fn process_span(
        &self,
        unit: &Unit,
        timeline: &Timeline,
        span: Range<usize>,
        progress: &dyn Progress,
    ) -> Result<PoseSpan> {
        let media = MediaInfo::read(&Artifact::MediaInfo.path(&self.work, unit))?;
        let n_passes = 1 + u64::from(self.follows_talker());
        let task = progress.begin(&unit.to_string(), n_passes * span.len() as u64);
        let video = VideoFrames { unit, timeline, media: &media, fps: self.fps, span };
        let talkers = self.follows_talker().then(|| {
            let search = TalkerSearch::new(&self.runtime()?, &self.chosen.store, &self.chosen.settings)?;
            pass::talkers(&video, &Artifact::Sound.path(&self.work, unit), search, &*task)
        });
        let choice = |choice: &Decision| -> Option<ChosenPerson> {
            let x = choice.x? as f32;
            // Mirrored videos are flipped back before persons are detected.
            let x = if media.pictures.mirrored { media.image_size[0] as f32 - 1.0 - x } else { x };
            Some((choice.frames(self.fps, timeline.n_frames()), [x, choice.y? as f32]))
        };
        let chosen: Vec<_> = self.choices(unit).into_iter().filter_map(choice).collect();
        let talkers = talkers.transpose()?;
        pass::estimate_poses(&video, self.chain(unit)?, talkers.as_deref(), &chosen, progress, &*task)
    }

    /// Opens the models and sets the reference picture of the speaker.
    fn chain(&self, unit: &Unit) -> Result<Chain> {
        let mut chain = Chain::new(&self.runtime()?, &self.chosen.store, &self.chosen.settings)?;
        if let Some(path) = self.references.get(&unit.speaker) {
            let mut reference = FrameReader::open(path, FrameRate::new(1, 1))?;
            let picture = reference.next().with_context(|| format!("{} contains no picture", path.display()))??;
            chain
                .set_reference(&picture.image)
                .with_context(|| format!("invalid reference picture {} of the speaker", path.display()))?;
        }
        Ok(chain)
    }
}
