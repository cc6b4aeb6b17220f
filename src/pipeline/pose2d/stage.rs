//! The way of a video: its frames at the dataset rate, one after the other, through a `Chain` that begins anew at each
//! shot, into `keypoints.npz`. A frame that repeats the one before is not looked at again.

use super::chain::Chain;
use super::models;
use super::store::KeypointFrames;
use crate::config;
use crate::config::Settings;
use crate::external::ffmpeg;
use crate::external::ffmpeg::ahead;
use crate::external::ffmpeg::frames::{FrameReader, FrameTime};
use crate::external::onnx::{ModelEntry, ModelError, ModelStore, Runtime};
use crate::external::opencv;
use crate::formats::keypoints_npz;
use crate::formats::media_json::MediaInfo;
use crate::formats::timeline_npz::Timeline;
use crate::stage::artifacts::{Artifact, StageName};
use crate::stage::progress::{Event, Progress};
use crate::stage::{Input, Report, Stage, Unit};
use crate::types::pose2d::{Keypoint, Pose2d};
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Frames after which the time that a video takes is told.
const N_MEASURED: usize = 150;

/// Stage `pose2d`.
pub struct Pose2dStage {
    settings: config::Pose2dConfig,
    models: config::ModelsConfig,
    fps: FrameRate,
    work: PathBuf,
    store: ModelStore,
    /// The picture that shows a speaker, by the speaker's name.
    references: BTreeMap<String, PathBuf>,
}

impl Pose2dStage {
    /// Reads the manifest and looks which models are there; opens none.
    ///
    /// # Errors
    /// A manifest that is not sound; a model that is not in it.
    pub fn new(settings: &Settings) -> Result<Self> {
        let named = settings.speaker.iter().filter(|speaker| !speaker.reference.as_os_str().is_empty());
        let references = named.map(|speaker| (speaker.name.clone(), speaker.reference.to_path_buf()));
        let store = ModelStore::open(&settings.models.dir)?;
        Ok(Self {
            settings: models::choose(&settings.pose2d, &store)?,
            models: settings.models.clone(),
            fps: settings.extract.rate(),
            work: settings.work.dir.to_path_buf(),
            store,
            references: references.collect(),
        })
    }

    /// The models it asks, with the key of `[pose2d]` that names each.
    pub fn used(&self) -> Result<Vec<(&'static str, &ModelEntry)>> {
        let named = models::keys(&self.settings).into_iter().filter(|(_, _, id)| !id.is_empty());
        named.map(|(key, role, id)| Ok((key, self.store.choose(id, role)?))).collect()
    }

    fn runtime(&self) -> Result<Runtime> {
        Runtime::load(&self.models.onnxruntime, &self.models.dir)
    }
}

impl Stage for Pose2dStage {
    fn name(&self) -> &'static str {
        StageName::Pose2d.as_str()
    }

    fn version(&self) -> u32 {
        5
    }

    fn cost(&self) -> u32 {
        40
    }

    fn settings(&self, _unit: &Unit) -> Value {
        let read = |entry: &ModelEntry| {
            json!({
                "id": entry.id, "picture": entry.picture, "fit": entry.fit,
                "decode": entry.decode, "points": entry.points, "sha256": entry.sha256,
            })
        };
        let models: serde_json::Map<String, Value> =
            self.used().unwrap_or_default().into_iter().map(|(key, entry)| (key.to_owned(), read(entry))).collect();
        json!({
            "pose2d": self.settings,
            "fps": [self.fps.num, self.fps.den],
            "models": models,
            "onnxruntime": self.runtime().map_or_else(|_| "missing".to_owned(), |runtime| runtime.version()),
            "opencv": opencv::version(),
            "ffmpeg": ffmpeg::version(),
        })
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
        for (key, entry) in self.used()? {
            let path = self.models.dir.join(&entry.file);
            if !path.exists() {
                return Err(ModelError::Missing { id: entry.id.clone(), path }.into());
            }
            inputs.push(input(format!("model:{key}"), path));
        }
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let restarts = Timeline::read(&Artifact::Timeline.path(&self.work, unit))?.restart;
        let mut chain = Chain::new(&self.runtime()?, &self.store, &self.settings)?;
        if let Some(path) = self.references.get(&unit.speaker) {
            let mut reference = FrameReader::open(path, FrameRate::new(1, 1))?;
            let picture = reference.next().with_context(|| format!("{} holds no picture", path.display()))??;
            chain
                .set_reference(&picture.image)
                .with_context(|| format!("the speaker's reference {}", path.display()))?;
        }
        let media = MediaInfo::read(&Artifact::MediaInfo.path(&self.work, unit))?;
        let reader = FrameReader::open(&unit.source, self.fps)?.with_options(media.pictures);
        let corner = media.active_area.map_or([0; 2], |area| [area.x, area.y]);
        let [width, height] = reader.image_size();
        let image_size = [u32::try_from(width)?, u32::try_from(height)?];
        let task = progress.begin(&unit.to_string(), restarts.len() as u64);
        let begun = Instant::now();
        let mut gathered = KeypointFrames::default();
        let mut seen = DetectionCounts::default();
        let mut pose = Pose2d::default();
        let restart_at = |idx: usize| {
            restarts.get(idx).copied().with_context(|| frame_count_mismatch(&unit.source, idx + 1, restarts.len()))
        };
        let pick = |reader: &mut FrameReader, time: FrameTime| {
            let is_new = time.frame_idx == 0 || restart_at(time.frame_idx)? || !time.repeated;
            let whole = is_new.then(|| reader.picture(None)).transpose()?;
            Ok(match (whole, media.active_area) {
                (Some(whole), Some(area)) => Some(whole.cropped(area)),
                (whole, _) => whole,
            })
        };
        ahead::for_each(reader, pick, |time, picture| {
            let idx = time.frame_idx;
            if restart_at(idx)? {
                chain.begin_shot();
            }
            if let Some(picture) = picture {
                pose = chain.frame(&picture).with_context(|| format!("frame {idx}"))?.moved(corner);
            }
            if idx + 1 == N_MEASURED && restarts.len() >= 6 * N_MEASURED {
                let hours = begun.elapsed().as_secs_f64() / (N_MEASURED as f64 / self.fps.per_sec());
                let line = format!("an hour of video takes about {hours:.1} h here, one at a time");
                progress.event(&Event::Estimate { line: &line });
            }
            seen.count(&pose);
            gathered.push(&pose, time.source_secs);
            task.advance(1);
            Ok(())
        })?;
        ensure!(
            gathered.n_frames() == restarts.len(),
            frame_count_mismatch(&unit.source, gathered.n_frames(), restarts.len())
        );
        let (keypoints, extras) = gathered.finish(self.fps, image_size)?;
        keypoints_npz::write(&Artifact::Keypoints.within(out), &keypoints, &extras)?;
        Ok(seen.report())
    }
}

fn frame_count_mismatch(video: &Path, found: usize, expected: usize) -> String {
    format!("{} gave {found} frames, its timeline has {expected}: run extract again", video.display())
}

/// How often each part of the speaker was found.
#[derive(Default)]
struct DetectionCounts {
    n_frames: usize,
    person: usize,
    left_hand: usize,
    right_hand: usize,
    several: usize,
    face: usize,
}

impl DetectionCounts {
    fn count(&mut self, pose: &Pose2d) {
        let any = |points: &[Keypoint]| usize::from(points.iter().any(|point| point.score > 0.0));
        self.n_frames += 1;
        self.person += any(&pose.body);
        self.left_hand += any(&pose.left_hand);
        self.right_hand += any(&pose.right_hand);
        self.several += usize::from(pose.n_people > 1);
        self.face += usize::from(pose.face.is_some());
    }

    fn report(&self) -> Report {
        let share = |n: usize| n as f64 / self.n_frames.max(1) as f64;
        let percent = |n: usize| format!("{:.0} %", 100.0 * share(n));
        let line = format!(
            "{} frames: person in {}, left hand {}, right hand {}",
            self.n_frames,
            percent(self.person),
            percent(self.left_hand),
            percent(self.right_hand)
        );
        let facts = json!({
            "n_frames": self.n_frames, "person": share(self.person), "left_hand": share(self.left_hand),
            "right_hand": share(self.right_hand), "several_people": share(self.several),
            "mouth": share(self.face),
        });
        Report { line, facts: facts.as_object().cloned().unwrap_or_default() }
    }
}
