//! `media.json`: properties of a video that later stages and users need.

use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::text::{clock, counted};
use orator_base::types::image::{PictureOptions, PixelArea};
use orator_base::types::sound::{AudioTracks, opposite_phase_note};
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Properties of a video: its length at the dataset rate, and the contents of its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MediaInfo {
    pub duration_secs: f64,
    /// Number of frames at the dataset rate.
    pub n_frames: usize,
    /// The dataset rate.
    pub fps: FrameRate,
    /// Width and height in px as displayed: upright, with square pixels.
    #[serde(default)]
    pub image_size: [usize; 2],
    /// Clockwise rotation from coded to upright image, degrees: 0, 90, 180 or 270.
    pub rotation: Option<u32>,
    /// Codec name used by ffmpeg: `h264`, `hevc`, `vp9`.
    pub codec: Option<String>,
    /// Average frame rate of the file; `None` if no header states it.
    pub source_fps: Option<FrameRate>,
    #[serde(default)]
    pub has_audio: bool,
    pub audio_secs: Option<f64>,
    /// Description of the parts of the file that could not be read.
    pub damage: Option<String>,
    /// Options for decoding the images.
    #[serde(default, skip_serializing_if = "PictureOptions::is_plain")]
    pub pictures: PictureOptions,
    /// Area inside letterbox or pillarbox bars, px of the upright image; `None` without bars.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub active_area: Option<PixelArea>,
    /// HDR transfer function, `PQ` or `HLG`; `None` for SDR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hdr: Option<String>,
    /// Number of times the image size changes.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub n_resizes: usize,
    /// Audio tracks, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub audio_tracks: Option<AudioTracks>,
    /// Time of the first image, at which the sound and all other times begin, in the file as players count it, seconds.
    #[serde(default, skip_serializing_if = "is_zero_secs")]
    pub first_image_secs: f64,
    /// Times at which another recording begins in a file of joined recordings, seconds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joins_secs: Vec<f64>,
    /// Seconds in which the two channels of stereo cancel out, so that the louder one replaces their mix.
    #[serde(default, skip_serializing_if = "is_zero_secs")]
    pub opposite_phase_secs: f64,
    /// Format of the keypoints that replace the video, such as `OpenPose, 25 points`; `None` for a video.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keypoints_from: Option<String>,
}

fn is_zero(n: &usize) -> bool {
    *n == 0
}

fn is_zero_secs(secs: &f64) -> bool {
    *secs == 0.0
}

/// Checks that require images, as listed in messages.
const IMAGE_CHECKS: &str = "cuts, static images and printed or on-screen persons";

impl MediaInfo {
    /// Video with a known length and nothing else.
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
            first_image_secs: 0.0,
            joins_secs: Vec::new(),
            opposite_phase_secs: 0.0,
            keypoints_from: None,
        }
    }

    /// Notes on unusual properties of the file and how each one was handled.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.pictures.deinterlace {
            notes.push("interlaced: deinterlaced".to_owned());
        }
        if self.pictures.mirrored {
            notes.push("mirrored: flipped back".to_owned());
        }
        if let Some(hdr) = &self.hdr {
            notes.push(format!("HDR ({hdr}): tone-mapped"));
        }
        if self.n_resizes > 0 {
            let times = if self.n_resizes == 1 { "once".to_owned() } else { format!("{} times", self.n_resizes) };
            notes.push(format!("the image size changes {times}: scaled to the first size"));
        }
        if let Some(first) = self.joins_secs.first() {
            let (n, first) = (counted(self.joins_secs.len() + 1, "recording"), clock(*first));
            notes.push(format!("{n} joined in one file, whose time stamps restart, first at {first}: a cut at each"));
        }
        notes.extend(opposite_phase_note(self.opposite_phase_secs));
        if let Some(area) = self.active_area {
            notes.push(format!("black bars: only the {}x{} px between them are analysed", area.width, area.height));
        }
        if let Some(tracks) = &self.audio_tracks {
            let named: Vec<&str> =
                tracks.languages.iter().map(|name| if name.is_empty() { "?" } else { name }).collect();
            let (n, selected) = (tracks.n_tracks, tracks.selected);
            notes.push(format!(
                "{n} audio tracks ({}): number {selected} is used (extract.audio_track)",
                named.join(", ")
            ));
        }
        notes
    }

    /// Note on the checks that were skipped because there are no images; `None` for a video.
    pub fn not_judged(&self) -> Option<String> {
        let format = self.keypoints_from.as_ref()?;
        Some(format!("from keypoints ({format}), without images: {IMAGE_CHECKS} are not checked"))
    }

    /// Reads `media.json`.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let info: Self =
            serde_json::from_slice(&bytes).with_context(|| format!("{} is damaged or incomplete", path.display()))?;
        for (field, secs) in [
            ("duration_secs", info.duration_secs),
            ("audio_secs", info.audio_secs.unwrap_or(0.0)),
            ("first_image_secs", info.first_image_secs),
            ("opposite_phase_secs", info.opposite_phase_secs),
        ] {
            ensure!(
                secs.is_finite() && secs >= 0.0,
                "{}: invalid `{field}` {secs}: expected 0 or more",
                path.display()
            );
        }
        info.fps.checked().with_context(|| format!("{}: `fps`", path.display()))?;
        Ok(info)
    }

    /// Writes `media.json`.
    pub fn write(&self, path: &Path) -> Result<()> {
        std::fs::write(path, serde_json::to_vec_pretty(self)?).with_context(|| path.display().to_string())
    }
}
