//! Bone lengths: one set per video, constant within its shards (`bones.json`, written by the lift stage), and one set
//! per speaker, the frame-weighted median over the videos.

use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::math::order::weighted_median;
use orator_base::types::skeleton::N_BONES;
use serde::{Deserialize, Serialize};
use std::path::Path;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VideoBones {
    /// Lengths from joints 1..=48 to their parents, metres; 0: not measured.
    pub lengths_metres: Vec<f64>,
    /// Number of frames that the lengths were measured in.
    pub n_frames: usize,
}

impl VideoBones {
    /// Reads `bones.json`.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let bones: Self = serde_json::from_slice(&bytes)
            .with_context(|| format!("{} is not a file of bone lengths: run the stage lift again", path.display()))?;
        check_lengths("lengths_metres", &bones.lengths_metres).with_context(|| path.display().to_string())?;
        Ok(bones)
    }
}

/// Checks bone lengths; `name` is the field named in the message.
pub fn check_lengths(name: &str, lengths: &[f64]) -> Result<()> {
    ensure!(lengths.len() == N_BONES, "`{name}` has {} lengths, expected {N_BONES}", lengths.len());
    let invalid = lengths.iter().find(|length| !(0.0..10.0).contains(*length));
    ensure!(invalid.is_none(), "`{name}` has the length {:?}, expected 0 to 10 m", invalid.unwrap_or(&0.0));
    Ok(())
}

/// Length of each bone of the speaker, metres: the median over the videos in which it was measured, weighted by frames;
/// 0 if it was measured in none.
pub fn of_speaker(videos: &[VideoBones]) -> [f32; N_BONES] {
    std::array::from_fn(|bone| {
        let lengths = videos.iter().filter_map(|video| {
            let length = *video.lengths_metres.get(bone)?;
            (length > 0.0 && video.n_frames > 0).then_some((length, video.n_frames as u64))
        });
        weighted_median(lengths.collect()).unwrap_or(0.0) as f32
    })
}
