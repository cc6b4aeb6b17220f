//! The way of a video: its frames at the dataset rate, one after the other, through a `Chain` that begins anew at each
//! shot, into `keypoints.npz`. A frame that repeats the one before is not looked at again. To follow who speaks, a
//! `TalkerSearch` sees the whole video first.

use super::chain::Chain;
use super::face::views::PortraitViews;
use super::models;
use super::store::KeypointFrames;
use super::talker::TalkerSearch;
use super::talker::choice::ShotVoice;
use super::talker::search::ShotTalker;
use crate::config;
use crate::config::{FollowRule, Settings};
use crate::external::ffmpeg;
use crate::external::ffmpeg::ahead;
use crate::external::ffmpeg::frames::{FrameReader, FrameTime};
use crate::external::onnx::{ModelEntry, ModelError, ModelStore, Runtime};
use crate::external::opencv;
use crate::external::opencv::png;
use crate::formats::keypoints_npz;
use crate::formats::media_json::MediaInfo;
use crate::formats::timeline_npz::Timeline;
use crate::pipeline::{lips, sound};
use crate::stage::artifacts::{Artifact, StageName};
use crate::stage::progress::{Event, Progress, Task};
use crate::stage::{Input, Report, Stage, Unit, counted, workdir};
use crate::types::image::Image;
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
    /// A manifest that is not sound; a model that is not in it; `follow = "speaking"` without the models that find who
    /// speaks.
    pub fn new(settings: &Settings) -> Result<Self> {
        let named = settings.speaker.iter().filter(|speaker| !speaker.reference.as_os_str().is_empty());
        let references = named.map(|speaker| (speaker.name.clone(), speaker.reference.to_path_buf()));
        let store = ModelStore::open(&settings.models.dir)?;
        let chosen = models::choose(&settings.pose2d, &store)?;
        models::check_follow(&chosen)?;
        Ok(Self {
            settings: chosen,
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
        7
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
        let mut pose2d = json!(self.settings);
        // The largest was followed before there was a choice: what was made then is what would be made now.
        if let Some(keys) = pose2d.as_object_mut().filter(|_| !self.follows_talker()) {
            keys.remove("follow");
        }
        json!({
            "pose2d": pose2d,
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
        let sound = Artifact::Sound.path(&self.work, unit);
        if self.follows_talker() && sound.exists() {
            inputs.push(input("sound".into(), sound));
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
        let media = MediaInfo::read(&Artifact::MediaInfo.path(&self.work, unit))?;
        let n_passes = 1 + u64::from(self.follows_talker());
        let task = progress.begin(&unit.to_string(), n_passes * restarts.len() as u64);
        let video = VideoFrames { unit, restarts: &restarts, media: &media, fps: self.fps };
        let talkers = if self.follows_talker() { self.talkers(&video, &*task)? } else { Vec::new() };
        let mut ways = talkers.iter().map(|shot| shot.path.clone());
        let mut chain = Chain::new(&self.runtime()?, &self.store, &self.settings)?;
        if let Some(path) = self.references.get(&unit.speaker) {
            let mut reference = FrameReader::open(path, FrameRate::new(1, 1))?;
            let picture = reference.next().with_context(|| format!("{} holds no picture", path.display()))??;
            chain
                .set_reference(&picture.image)
                .with_context(|| format!("the speaker's reference {}", path.display()))?;
        }
        let corner = media.active_area.map_or([0; 2], |area| [area.x, area.y]);
        let begun = Instant::now();
        let mut gathered = KeypointFrames::default();
        let mut seen = DetectionCounts::default();
        let mut pose = Pose2d::default();
        let mut portrait = PortraitViews::default();
        let image_size = video.each(|time, begins_shot, picture| {
            let idx = time.frame_idx;
            if begins_shot || idx == 0 {
                chain.begin_shot_of(ways.next().flatten());
            }
            if let Some(picture) = picture {
                let seen = chain.frame(&picture).with_context(|| format!("frame {idx}"))?;
                if let Some(points) = chain.face_points() {
                    portrait.look(&picture, points, time.source_secs)?;
                }
                pose = seen.moved(corner);
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
        let (keypoints, extras) = gathered.finish(self.fps, image_size)?;
        keypoints_npz::write(&Artifact::Keypoints.within(out), &keypoints, &extras)?;
        if let Some((portrait, picture)) = portrait.finish() {
            workdir::write_file(&Artifact::Portrait.within(out), &serde_json::to_vec(&portrait)?)?;
            png::write(&Artifact::FacePicture.within(out), &picture)?;
        }
        let mut report = seen.report();
        if self.follows_talker() {
            tell_followed(&talkers, &mut report);
        }
        Ok(report)
    }
}

impl Pose2dStage {
    fn follows_talker(&self) -> bool {
        self.settings.follow == FollowRule::Speaking
    }

    /// Who speaks in each shot.
    fn talkers(&self, video: &VideoFrames, task: &dyn Task) -> Result<Vec<ShotTalker>> {
        let sound = Artifact::Sound.path(&self.work, video.unit);
        let (_, sound_db) = sound::levels(&sound, self.fps, video.restarts.len())?;
        let is_speech: Vec<bool> = sound_db.iter().map(|&db| lips::is_speech(f32::NAN, db)).collect();
        let voice = sound::openness(&sound)?;
        let mut search = TalkerSearch::new(&self.runtime()?, &self.store, &self.settings)?;
        let (mut talkers, mut time_secs) = (Vec::new(), Vec::new());
        let mut end_shot = |search: &mut TalkerSearch, time_secs: &mut Vec<f64>, end: usize| {
            let is_speech = &is_speech[end - time_secs.len()..end];
            talkers.push(search.end_shot(&ShotVoice { voice: &voice, fps: self.fps, time_secs, is_speech }));
            time_secs.clear();
        };
        video.each(|time, begins_shot, picture| {
            let idx = time.frame_idx;
            if begins_shot && idx > 0 {
                end_shot(&mut search, &mut time_secs, idx);
            }
            search.frame(picture.as_ref()).with_context(|| format!("frame {idx}"))?;
            time_secs.push(time.source_secs);
            task.advance(1);
            Ok(())
        })?;
        end_shot(&mut search, &mut time_secs, video.restarts.len());
        Ok(talkers)
    }
}

/// The frames of a video in the order of its timeline.
struct VideoFrames<'a> {
    unit: &'a Unit,
    /// Where a shot begins.
    restarts: &'a [bool],
    media: &'a MediaInfo,
    fps: FrameRate,
}

impl VideoFrames<'_> {
    /// Calls `work` with each frame's time, whether it begins a shot, and its picture if that is not the one before
    /// again. Returns the width and height of the whole picture in px.
    ///
    /// # Errors
    /// A video that cannot be read or has not as many frames as the timeline.
    fn each(&self, mut work: impl FnMut(FrameTime, bool, Option<Image>) -> Result<()>) -> Result<[u32; 2]> {
        let (source, restarts) = (&self.unit.source, self.restarts);
        let reader = FrameReader::open(source, self.fps)?.with_options(self.media.pictures);
        let [width, height] = reader.image_size();
        let restart_at = |idx: usize| {
            restarts.get(idx).copied().with_context(|| frame_count_mismatch(source, idx + 1, restarts.len()))
        };
        let pick = |reader: &mut FrameReader, time: FrameTime| {
            let is_new = time.frame_idx == 0 || restart_at(time.frame_idx)? || !time.repeated;
            let whole = is_new.then(|| reader.picture(None)).transpose()?;
            Ok(match (whole, self.media.active_area) {
                (Some(whole), Some(area)) => Some(whole.cropped(area)),
                (whole, _) => whole,
            })
        };
        let mut n_frames = 0;
        ahead::for_each(reader, pick, |time, picture| {
            n_frames = time.frame_idx + 1;
            work(time, restart_at(time.frame_idx)?, picture)
        })?;
        ensure!(n_frames == restarts.len(), frame_count_mismatch(source, n_frames, restarts.len()));
        Ok([u32::try_from(width)?, u32::try_from(height)?])
    }
}

/// Adds in how many shots the one who speaks is followed, and in how many the largest for want of a clear one.
fn tell_followed(talkers: &[ShotTalker], report: &mut Report) {
    let n_several = talkers.iter().filter(|shot| shot.several).count();
    let n_clear = talkers.iter().filter(|shot| shot.path.is_some()).count();
    report.facts.insert("followed".to_owned(), json!({ "several": n_several, "speaking": n_clear }));
    if n_several > n_clear {
        let shots = counted(n_several, "shot");
        let rest = n_several - n_clear;
        report.line += &format!(
            "; several people in {shots}: in {rest} nobody's mouth clearly follows the voice, so the largest is followed"
        );
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
