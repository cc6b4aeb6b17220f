//! Bone lengths: constant within a video's shards (`bones.json`, written by the lift stage), and one set for the
//! speaker, the frame-weighted median over the videos.

use anyhow::{Context, Result, ensure};
use orator_base::math::order::weighted_median;
use orator_base::types::skeleton::N_BONES;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Bone lengths of one video.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VideoBones {
    /// Lengths from joints 1..=48 to their parents, metres; 0: not measured.
    pub lengths_metres: Vec<f64>,
    /// Number of frames of the measurement.
    pub n_frames: usize,
}

impl VideoBones {
    /// Reads `bones.json`.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let bones: Self =
            serde_json::from_slice(&bytes).with_context(|| format!("{} holds no bone lengths", path.display()))?;
        let plausible = bones.lengths_metres.iter().all(|length| (0.0..10.0).contains(length));
        ensure!(
            bones.lengths_metres.len() == N_BONES && plausible,
            "{}: expected {N_BONES} lengths from 0 to 10 metres",
            path.display()
        );
        Ok(bones)
    }
}

/// Weighted median of each bone over the videos in which it was measured; 0 where it never was.
pub fn of_speaker(videos: &[VideoBones]) -> [f32; N_BONES] {
    std::array::from_fn(|bone| {
        let lengths = videos.iter().filter_map(|video| {
            let length = *video.lengths_metres.get(bone)?;
            (length > 0.0 && video.n_frames > 0).then_some((length, video.n_frames as u64))
        });
        weighted_median(lengths.collect()).unwrap_or(0.0) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_videos_weigh_more_and_unmeasured_bones_nothing() {
        let video = |length: f64, n_frames| {
            let mut lengths_metres = vec![length; N_BONES];
            lengths_metres[6] = 0.0;
            VideoBones { lengths_metres, n_frames }
        };
        let lengths = of_speaker(&[video(0.3, 100), video(0.2, 40), video(0.9, 50), video(0.0, 1000)]);
        assert_eq!((lengths[0], lengths[6]), (0.3, 0.0));
        assert_eq!(of_speaker(&[video(0.3, 0)])[0], 0.0);
    }
}
