//! The stage. Writes the sound (16 kHz mono s16, its first sample at the first picture; absent without sound), the
//! `Timeline` at the dataset rate, `MediaInfo`, and, only if asked, the pictures as PNG.

use super::shots::{RESTART, ShotFinder};
use super::thumbnail::{THUMBNAIL, mean_change};
use crate::config;
use crate::external::ffmpeg;
use crate::external::ffmpeg::frames::FrameReader;
use crate::external::opencv::png;
use crate::formats::media_json::MediaInfo;
use crate::formats::timeline_npz::Timeline;
use crate::stage::artifacts::{Artifact, StageName};
use crate::stage::progress::Progress;
use crate::stage::{Input, Report, Stage, Unit, counted};
use crate::types::sound::SAMPLE_RATE;
use anyhow::{Context, Result};
use serde_json::json;
use std::fs;
use std::path::Path;

/// Video to sound and timeline.
pub struct ExtractStage {
    settings: config::ExtractConfig,
}

impl ExtractStage {
    pub fn new(settings: &config::ExtractConfig) -> Self {
        Self { settings: settings.clone() }
    }
}

impl Stage for ExtractStage {
    fn name(&self) -> &'static str {
        StageName::Extract.as_str()
    }

    fn version(&self) -> u32 {
        2
    }

    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        json!({ "extract": self.settings, "sample_rate": SAMPLE_RATE, "ffmpeg": ffmpeg::version() })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        Ok(vec![Input { role: "video".into(), path: unit.source.clone() }])
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let rate = self.settings.rate();
        let mut reader = FrameReader::open(&unit.source, rate)?;
        let timeline = self.timeline(&mut reader, out, progress)?;
        timeline.write(&Artifact::Timeline.within(out))?;
        let sound = super::audio_file::extract_wav(&unit.source, &Artifact::Sound.within(out), SAMPLE_RATE)?;
        let audio_secs = sound.as_ref().map(|sound| sound.secs);

        let n_frames = timeline.n_frames();
        let n_cuts = timeline.restart.iter().filter(|restart| **restart).count();
        let damage: Vec<String> = reader.damage().into_iter().chain(sound.and_then(|sound| sound.damage)).collect();
        let damage = (!damage.is_empty()).then(|| damage.join(", "));
        let video = reader.info().video.as_ref();
        let media = MediaInfo {
            duration_secs: reader.duration_secs(),
            n_frames,
            fps: rate,
            image_size: reader.image_size(),
            rotation: video.map(|video| video.rotation),
            codec: video.map(|video| video.codec.clone()),
            source_fps: video.and_then(|video| video.fps),
            has_audio: audio_secs.is_some(),
            audio_secs,
            damage,
        };
        media.write(&Artifact::MediaInfo.within(out))?;

        let sound = audio_secs.map_or("no sound".to_owned(), |secs| format!("{secs:.1} s of sound"));
        let cuts = if n_cuts == 0 { "no cut".to_owned() } else { counted(n_cuts, "cut") };
        let mut facts = serde_json::to_value(&media)?.as_object().cloned().unwrap_or_default();
        facts.insert("n_cuts".into(), n_cuts.into());
        let kept = |damage: &String| format!("; damaged, what could be read is kept: {damage}");
        let damage = media.damage.as_ref().map(kept).unwrap_or_default();
        Ok(Report { line: format!("{n_frames} frames at {rate}, {cuts}, {sound}{damage}"), facts })
    }
}

impl ExtractStage {
    /// Reads the pictures once; of each only a thumbnail is converted, unless the frames are kept.
    fn timeline(&self, reader: &mut FrameReader, out: &Path, progress: &dyn Progress) -> Result<Timeline> {
        let mut timeline = Timeline::default();
        let (mut shots, mut before) = (ShotFinder::new(self.settings.rate()), None);
        let frames = Artifact::Frames.within(out);
        if self.settings.keep_frames {
            fs::create_dir(&frames).with_context(|| format!("cannot make the folder {}", frames.display()))?;
        }
        let task = progress.begin("frames", reader.expected_frames().unwrap_or(0) as u64);
        while let Some(time) = reader.advance()? {
            timeline.source_secs.push(time.source_secs);
            timeline.repeated.push(time.repeated);
            let picture = if time.repeated { None } else { Some(reader.picture(Some(THUMBNAIL))?) };
            shots.push(picture.clone());
            let pair = before.as_ref().zip(picture.as_ref());
            timeline.frame_difference.push(pair.map_or(0.0, |(a, b)| mean_change(a, b)));
            before = picture.or(before);
            if self.settings.keep_frames {
                png::write(&frames.join(format!("{:06}.png", time.frame_idx)), &reader.picture(None)?)?;
            }
            task.advance(1);
        }
        timeline.shot_score = shots.finish();
        timeline.restart = timeline.shot_score.iter().map(|score| *score >= RESTART).collect();
        Ok(timeline)
    }
}
