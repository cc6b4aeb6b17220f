//! What tells the person of a video from another: the shape of the face, and the colours of skin and hair. It lies beside
//! the keypoints; no dataset holds any of it.

use anyhow::{Context, Result};
use orator_base::math::procrustes::similarity;
use orator_base::math::vec3::{self, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Person of a video, as far as faces tell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Portrait {
    /// Points of the face, its centre at the origin and their root mean square distance from it 1; none where it was never
    /// seen from the front.
    pub face: Vec<Vec3>,
    /// Cumulated distributions of light and of two differences of colour.
    pub skin: Vec<f32>,
    pub hair: Vec<f32>,
    /// Frames they are taken from.
    pub n_frames: usize,
}

impl Portrait {
    /// Reads `portrait.json`.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        serde_json::from_slice(&bytes).with_context(|| format!("{} holds no portrait", path.display()))
    }

    /// Distance of the shapes of two faces: root mean square of their points', in thousandths of a face's size.
    pub fn face_distance(&self, other: &Self) -> Option<f64> {
        let fit = similarity(&self.face, &other.face)?;
        let pairs = || self.face.iter().zip(&other.face);
        let sum: f64 = pairs().map(|(a, b)| vec3::norm(vec3::sub(fit.apply(*a), *b)).powi(2)).sum();
        Some(1000.0 * (sum / pairs().count() as f64).sqrt())
    }

    /// Distance of the colours of skin and hair: the sum of the mean ways that they must go, in 8-bit steps.
    pub fn colour_distance(&self, other: &Self) -> f64 {
        let way = |some: &[f32], others: &[f32]| {
            let steps: f32 = some.iter().zip(others).map(|(a, b)| (a - b).abs()).sum();
            256.0 * f64::from(steps) / some.len().max(1) as f64
        };
        way(&self.skin, &other.skin) + way(&self.hair, &other.hair)
    }
}
