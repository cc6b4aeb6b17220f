//! The stages `extract` and `pose2d` for keypoints of other programs. `extract` reads them and writes audio, timeline
//! and `MediaInfo` as for a video, and the keypoints at the dataset rate; `pose2d` copies these. Values that need
//! pictures are NaN.

use super::convert::{ConvertedKeypoints, convert};
use crate::sound::extract_wav;
use anyhow::{Context, Result, anyhow, bail};
use ndarray::{Array3, s};
use orator_base::stage::artifacts::{Artifact, StageName, dir};
use orator_base::stage::progress::Progress;
use orator_base::stage::{Input, Report, Stage, StageWrapper, Unit};
use orator_base::text::counted;
use orator_base::text::length;
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{ExtractConfig, KeypointSource, Settings};
use orator_formats::media_json::MediaInfo;
use orator_formats::timeline_npz::Timeline;
use orator_formats::{keypoints, keypoints_npz};
use orator_media::ffmpeg::origin;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Version of the readers; increased when the same file yields different keypoints.
const READERS: u32 = 3;

/// `extract` for keypoints: audio, timeline and keypoints at the dataset rate.
pub struct KeypointExtractStage {
    settings: ExtractConfig,
    /// Configuration entries by speaker and video.
    sources: BTreeMap<(String, String), KeypointSource>,
}

/// `pose2d` for keypoints: copies the keypoints that `extract` wrote.
pub struct KeypointPose2dStage {
    work: PathBuf,
}

impl KeypointExtractStage {
    pub fn new(settings: &ExtractConfig, videos: &[Videos]) -> Self {
        let of = |videos: &Videos| {
            let key = |video: &String| (videos.speaker.clone(), video.clone());
            videos.keypoints.iter().map(|(video, source)| (key(video), source.clone())).collect::<Vec<_>>()
        };
        Self { settings: settings.clone(), sources: videos.iter().flat_map(of).collect() }
    }

    fn source(&self, unit: &Unit) -> Option<&KeypointSource> {
        self.sources.get(&(unit.speaker.clone(), unit.video.clone()))
    }

    fn sound(&self, unit: &Unit) -> Result<PathBuf> {
        let source = self.source(unit).with_context(|| format!("no keypoints are configured for {unit}"))?;
        source.sound.clone().map_err(|message| anyhow!("{}: {message}", unit.source.display()))
    }
}

impl Stage for KeypointExtractStage {
    fn name(&self) -> &'static str {
        StageName::Extract.as_str()
    }

    fn version(&self) -> u32 {
        READERS
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        let source = self.source(unit);
        json!({
            "readers": READERS, "rate": self.settings.rate(), "sample_rate": SAMPLE_RATE,
            "audio_track": self.settings.audio_track,
            "fps": source.and_then(|source| source.fps), "size": source.and_then(|source| source.image_size),
        })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let sound = Input { role: "sound".into(), path: self.sound(unit)? };
        Ok(vec![Input { role: "video".into(), path: unit.source.clone() }, sound])
    }

    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> Result<Report> {
        let file = unit.source.display();
        let found = keypoints::read(&unit.source)?;
        let source = self.source(unit).with_context(|| format!("no keypoints are configured for {unit}"))?;
        let Some(source_fps) = source.fps.or(found.fps) else {
            bail!(
                "{file} does not state its frame rate: set it beside `keypoints` in [[speaker]], for example `fps = 25`"
            );
        };
        let Some(image_size) = source.image_size.or(found.image_size) else {
            bail!(
                "{file} does not state its image size: set it beside `keypoints` in [[speaker]], for example `size = \"1280x720\"`"
            );
        };
        let format = format!("{} at {source_fps}", found.format);
        let fps = self.settings.rate();
        let ConvertedKeypoints { keypoints, extras, duration_secs, notes } =
            convert(found, source_fps, image_size, fps)?;
        let n_frames = keypoints.n_frames();
        keypoints_npz::write(&Artifact::Keypoints.within(out), &keypoints, &extras)?;
        timeline_without_pictures(extras.time_secs.to_vec()).write(&Artifact::Timeline.within(out))?;
        let sound =
            extract_wav(&self.sound(unit)?, self.settings.audio_track, &Artifact::Sound.within(out), SAMPLE_RATE)?;
        let audio_secs = sound.as_ref().map(|sound| sound.secs);
        let opposite_phase_secs = sound.as_ref().map_or(0.0, |sound| sound.opposite_phase_secs);
        let media = MediaInfo {
            image_size: image_size.map(|px| px as usize),
            source_fps: Some(source_fps),
            has_audio: audio_secs.is_some(),
            audio_secs,
            damage: sound.and_then(|sound| sound.damage),
            first_image_secs: origin::start_secs(&self.sound(unit)?)?,
            opposite_phase_secs,
            keypoints_from: Some(format),
            ..MediaInfo::new(duration_secs, n_frames, fps)
        };
        media.write(&Artifact::MediaInfo.within(out))?;
        let sound = audio_secs.map_or("no audio".to_owned(), |secs| format!("{} of audio", length(secs)));
        let remarks =
            media.not_judged().into_iter().chain(media.notes()).chain(media.damage.clone()).chain(notes.clone());
        let remarks = remarks.collect::<Vec<_>>().join("; ");
        let mut facts = serde_json::to_value(&media)?.as_object().cloned().unwrap_or_default();
        facts.insert("notes".into(), notes.into());
        Ok(Report { line: format!("{} at {fps}, {sound}; {remarks}", counted(n_frames, "frame")), facts })
    }
}

/// Timeline of frames without pictures: movement and shots are unknown.
fn timeline_without_pictures(source_secs: Vec<f64>) -> Timeline {
    let n_frames = source_secs.len();
    Timeline {
        source_secs,
        repeated: vec![false; n_frames],
        shot_score: vec![f64::NAN; n_frames],
        restart: vec![false; n_frames],
        span: vec![false; n_frames],
        frame_difference: vec![f32::NAN; n_frames],
    }
}

impl KeypointPose2dStage {
    fn keypoints_path(&self, unit: &Unit) -> PathBuf {
        Artifact::Keypoints.within(&dir(&self.work, StageName::Extract, unit))
    }
}

impl Stage for KeypointPose2dStage {
    fn name(&self) -> &'static str {
        StageName::Pose2d.as_str()
    }

    fn version(&self) -> u32 {
        READERS
    }

    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        json!({ "keypoints": "as found by another program" })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        Ok(vec![Input { role: "keypoints".into(), path: self.keypoints_path(unit) }])
    }

    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> Result<Report> {
        let (from, to) = (self.keypoints_path(unit), Artifact::Keypoints.within(out));
        let copy = || std::io::copy(&mut File::open(&from)?, &mut File::create(&to)?);
        copy().with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))?;
        let (keypoints, extras) = (keypoints_npz::read(&to)?, keypoints_npz::read_extras(&to)?);
        let share = |points: &Array3<f32>| {
            let n_visible =
                points.slice(s![.., .., 2]).outer_iter().filter(|scores| scores.iter().any(|s| *s > 0.0)).count();
            n_visible as f64 / keypoints.n_frames().max(1) as f64
        };
        let [body, left, right] = [&keypoints.body, &keypoints.left_hand, &keypoints.right_hand].map(share);
        let several = extras.n_persons.iter().filter(|n| **n > 1).count() as f64 / keypoints.n_frames().max(1) as f64;
        let line = format!(
            "{} frames: person in {:.0} %, left hand {:.0} %, right hand {:.0} % (keypoints of another program)",
            keypoints.n_frames(),
            100.0 * body,
            100.0 * left,
            100.0 * right
        );
        let facts = json!({
            "n_frames": keypoints.n_frames(), "person": body, "left_hand": left, "right_hand": right,
            "several_persons": several,
        });
        Ok(Report { line, facts: facts.as_object().cloned().unwrap_or_default() })
    }
}

/// Stage with one implementation for videos and one for keypoints of other programs, and the units that are keypoints.
pub struct StageBySource {
    of_videos: Box<dyn Stage>,
    of_keypoints: Box<dyn Stage>,
    keypoints: BTreeSet<(String, String)>,
}

impl StageBySource {
    pub fn extract(of_videos: Box<dyn Stage>, settings: &Settings, all: &[Videos]) -> Box<dyn Stage> {
        let of_keypoints = KeypointExtractStage::new(&settings.extract, all);
        Self::dispatch(of_videos, Box::new(of_keypoints), all)
    }

    pub fn pose2d(of_videos: Box<dyn Stage>, settings: &Settings, all: &[Videos]) -> Box<dyn Stage> {
        Self::dispatch(of_videos, Box::new(KeypointPose2dStage { work: settings.work.dir.clone() }), all)
    }

    /// The video implementation alone, if no unit consists of keypoints.
    fn dispatch(of_videos: Box<dyn Stage>, of_keypoints: Box<dyn Stage>, all: &[Videos]) -> Box<dyn Stage> {
        let names = |videos: &Videos| {
            videos.keypoints.keys().map(|video| (videos.speaker.clone(), video.clone())).collect::<Vec<_>>()
        };
        let keypoints: BTreeSet<(String, String)> = all.iter().flat_map(names).collect();
        if keypoints.is_empty() { of_videos } else { Box::new(Self { of_videos, of_keypoints, keypoints }) }
    }
}

impl StageWrapper for StageBySource {
    /// Version and cost are those of the video implementation; that of the keypoint implementation is in its settings.
    fn inner(&self, unit: Option<&Unit>) -> &dyn Stage {
        let is_keypoints =
            unit.is_some_and(|unit| self.keypoints.contains(&(unit.speaker.clone(), unit.video.clone())));
        if is_keypoints { &*self.of_keypoints } else { &*self.of_videos }
    }
}
