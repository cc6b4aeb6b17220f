//! The stage's files. `audio.wav`: 16 kHz mono s16, its first sample at the first picture (absent without sound).
//! `timeline.npz`, at the dataset rate: `source_secs` f64 [T], `repeated` bool [T], `shot_score` f64 [T] (0..1; the
//! frame with the score would begin a shot), `restart` bool [T] (the score is high enough that following begins anew),
//! `still` f32 [T] (mean change of the picture since the frame before, 8-bit steps; 0 where it is repeated).
//! `media.json`: what the video is. `frames/`, only if asked: the pictures as PNG.

use super::frame_difference;
use super::frame_difference::THUMBNAIL;
use super::shots::{RESTART, ShotFinder};
use crate::config;
use crate::external::ffmpeg;
use crate::external::ffmpeg::audio;
use crate::external::ffmpeg::frames::FrameReader;
use crate::external::opencv::png;
use crate::stage::artifacts::{Artifact, StageName};
use crate::stage::progress::Progress;
use crate::stage::{Input, Report, Stage, Unit};
use crate::types::sound::SAMPLE_RATE;
use anyhow::{Context, Result};
use ndarray::Array1;
use ndarray_npy::NpzWriter;
use serde_json::json;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Video to sound and timeline.
pub struct Extract {
    settings: config::Extract,
}

impl Extract {
    pub fn new(settings: &config::Extract) -> Self {
        Self { settings: settings.clone() }
    }
}

/// The frames at the dataset rate, one value each.
struct Timeline {
    source_secs: Vec<f64>,
    repeated: Vec<bool>,
    shot_scores: Vec<f64>,
    still: Vec<f32>,
}

impl Stage for Extract {
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
        write_timeline(&Artifact::Timeline.within(out), &timeline)?;
        let sound = audio::extract_wav(&unit.source, &Artifact::Sound.within(out), SAMPLE_RATE)?;
        let audio_secs = sound.as_ref().map(|sound| sound.secs);

        let n_frames = timeline.source_secs.len();
        let n_cuts = timeline.shot_scores.iter().filter(|score| **score >= RESTART).count();
        let damage: Vec<String> = reader.damage().into_iter().chain(sound.and_then(|sound| sound.damage)).collect();
        let damage = (!damage.is_empty()).then(|| damage.join(", "));
        let video = reader.info().video.as_ref();
        let media = json!({
            "duration_secs": reader.duration_secs(),
            "n_frames": n_frames,
            "fps": rate,
            "image_size": reader.image_size(),
            "rotation": video.map(|video| video.rotation),
            "codec": video.map(|video| &video.codec),
            "source_fps": video.and_then(|video| video.fps),
            "has_audio": audio_secs.is_some(),
            "audio_secs": audio_secs,
            "damage": damage,
        });
        let path = Artifact::MediaInfo.within(out);
        fs::write(&path, serde_json::to_vec_pretty(&media)?).with_context(|| path.display().to_string())?;

        let sound = audio_secs.map_or("no sound".to_owned(), |secs| format!("{secs:.1} s of sound"));
        let cuts = match n_cuts {
            0 => "no cut".to_owned(),
            1 => "1 cut".to_owned(),
            n => format!("{n} cuts"),
        };
        let mut facts = media.as_object().cloned().unwrap_or_default();
        facts.insert("n_cuts".into(), n_cuts.into());
        let kept = |damage: &String| format!("; damaged, what could be read is kept: {damage}");
        let damage = damage.as_ref().map(kept).unwrap_or_default();
        Ok(Report { line: format!("{n_frames} frames at {rate}, {cuts}, {sound}{damage}"), facts })
    }
}

impl Extract {
    /// Reads the pictures once; of each only a thumbnail is converted, unless the frames are kept.
    fn timeline(&self, reader: &mut FrameReader, out: &Path, progress: &dyn Progress) -> Result<Timeline> {
        let (mut source_secs, mut repeated, mut still) = (Vec::new(), Vec::new(), Vec::new());
        let (mut shots, mut before) = (ShotFinder::new(self.settings.rate()), None);
        let frames = Artifact::Frames.within(out);
        if self.settings.keep_frames {
            fs::create_dir(&frames).with_context(|| format!("cannot make the folder {}", frames.display()))?;
        }
        let task = progress.begin("frames", reader.expected_frames().unwrap_or(0) as u64);
        while let Some(time) = reader.advance()? {
            source_secs.push(time.source_secs);
            repeated.push(time.repeated);
            let seen = if time.repeated { None } else { Some(reader.picture(Some(THUMBNAIL))?) };
            shots.push(seen.clone());
            still.push(before.as_ref().zip(seen.as_ref()).map_or(0.0, |(a, b)| frame_difference::difference(a, b)));
            before = seen.or(before);
            if self.settings.keep_frames {
                png::write(&frames.join(format!("{:06}.png", time.frame_idx)), &reader.picture(None)?)?;
            }
            task.advance(1);
        }
        Ok(Timeline { source_secs, repeated, shot_scores: shots.finish(), still })
    }
}

fn write_timeline(path: &Path, timeline: &Timeline) -> Result<()> {
    let write = || -> Result<()> {
        let mut npz = NpzWriter::new(BufWriter::new(File::create(path)?));
        npz.add_array("source_secs", &Array1::from_vec(timeline.source_secs.clone()))?;
        npz.add_array("repeated", &Array1::from_vec(timeline.repeated.clone()))?;
        let restart = timeline.shot_scores.iter().map(|score| *score >= RESTART).collect();
        npz.add_array("shot_score", &Array1::from_vec(timeline.shot_scores.clone()))?;
        npz.add_array("restart", &Array1::from_vec(restart))?;
        npz.add_array("still", &Array1::from_vec(timeline.still.clone()))?;
        Ok(npz.finish()?.flush()?)
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}
