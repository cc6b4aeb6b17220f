//! `media.json`: what a video is, as far as the stages after the first need it and people want to know.

use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::types::image::{PictureOptions, PixelArea};
use orator_base::types::sound::AudioTracks;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A video: its length at the dataset rate, and what its file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MediaInfo {
    pub duration_secs: f64,
    /// Frames at the dataset rate.
    pub n_frames: usize,
    /// The dataset rate.
    pub fps: FrameRate,
    /// Width and height in px as shown: turned upright, with square pixels.
    #[serde(default)]
    pub image_size: [usize; 2],
    /// Degrees clockwise from coded to upright: 0, 90, 180 or 270.
    pub rotation: Option<u32>,
    /// ffmpeg's name: `h264`, `hevc`, `vp9`.
    pub codec: Option<String>,
    /// Average frames a second of the file; `None` if no header says.
    pub source_fps: Option<FrameRate>,
    #[serde(default)]
    pub has_audio: bool,
    /// Length of the sound, seconds.
    pub audio_secs: Option<f64>,
    /// What could not be read of the file.
    pub damage: Option<String>,
    /// How its pictures are to be read.
    #[serde(default, skip_serializing_if = "PictureOptions::is_plain")]
    pub pictures: PictureOptions,
    /// Part of the pictures between bars, px of the upright picture; `None` without bars.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub active_area: Option<PixelArea>,
    /// HDR transfer function, `PQ` or `HLG`; `None` for SDR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hdr: Option<String>,
    /// Number of times the size of the pictures changes.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub n_resizes: usize,
    /// The sound tracks, where there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub audio_tracks: Option<AudioTracks>,
    /// Format of the keypoints that stand in for the pictures, `OpenPose, 25 points`; `None`: a video with pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keypoints_from: Option<String>,
}

fn is_zero(n: &usize) -> bool {
    *n == 0
}

/// Properties that only pictures tell, for people.
const OF_PICTURES: &str = "cuts, still pictures and whether the person is a picture";

impl MediaInfo {
    /// A video of which nothing but its length is known.
    pub const fn new(duration_secs: f64, n_frames: usize, fps: FrameRate) -> Self {
        Self {
            duration_secs,
            n_frames,
            fps,
            image_size: [0, 0],
            rotation: None,
            codec: None,
            source_fps: None,
            has_audio: false,
            audio_secs: None,
            damage: None,
            pictures: PictureOptions { deinterlace: false, mirrored: false },
            active_area: None,
            hdr: None,
            n_resizes: 0,
            audio_tracks: None,
            keypoints_from: None,
        }
    }

    /// What is out of the ordinary about a file, and what was done about it.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.pictures.deinterlace {
            remarks.push("interlaced, deinterlaced".to_owned());
        }
        if self.pictures.mirrored {
            remarks.push("mirrored, turned back".to_owned());
        }
        if let Some(hdr) = &self.hdr {
            remarks.push(format!("HDR ({hdr}), tone-mapped"));
        }
        if self.n_resizes > 0 {
            let times = if self.n_resizes == 1 { "once".to_owned() } else { format!("{} times", self.n_resizes) };
            remarks.push(format!("the pictures change their size {times}, brought to the first"));
        }
        if let Some(area) = self.active_area {
            remarks.push(format!("bars, {}x{} px between them looked at", area.width, area.height));
        }
        if let Some(tracks) = &self.audio_tracks {
            let named: Vec<&str> =
                tracks.languages.iter().map(|name| if name.is_empty() { "?" } else { name }).collect();
            let (n, taken) = (tracks.n_tracks, tracks.taken);
            remarks.push(format!("{n} sound tracks ({}), number {taken} taken: extract.audio_track", named.join(", ")));
        }
        remarks
    }

    /// Sentence about what is not judged, as there are no pictures; `None`: all of it is.
    pub fn not_judged(&self) -> Option<String> {
        let format = self.keypoints_from.as_ref()?;
        Some(format!("from keypoints ({format}), without pictures: {OF_PICTURES} are not judged"))
    }

    /// Reads `media.json`. Errors: unreadable, incomplete, or a duration that is none.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path, input::MOST_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let info: Self = serde_json::from_slice(&bytes).with_context(|| format!("{} is incomplete", path.display()))?;
        for (field, secs) in [("duration_secs", info.duration_secs), ("audio_secs", info.audio_secs.unwrap_or(0.0))] {
            ensure!(secs.is_finite() && secs >= 0.0, "{}: `{field}` is {secs}, expected 0 or more", path.display());
        }
        info.fps.checked().with_context(|| format!("{}: `fps`", path.display()))?;
        Ok(info)
    }

    /// Writes `media.json`.
    pub fn write(&self, path: &Path) -> Result<()> {
        std::fs::write(path, serde_json::to_vec_pretty(self)?).with_context(|| path.display().to_string())
    }
}
