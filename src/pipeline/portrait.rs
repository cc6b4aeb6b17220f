//! Description of a person that distinguishes videos of different people: the shape of the face, and the colours of
//! skin and hair. Stored beside the keypoints; no dataset contains any of it.

use anyhow::{Context, Result};
use orator_base::math::procrustes::similarity;
use orator_base::math::vec3::{self, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Face shape and colours of the person in a video.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Portrait {
    /// Face points, centred, at a root mean square distance of 1; empty if the face was never seen from the front.
    pub face: Vec<Vec3>,
    /// Cumulative distributions of lightness and two colour differences.
    pub skin: Vec<f32>,
    pub hair: Vec<f32>,
    /// Number of frames that the description is derived from.
    pub n_frames: usize,
}

impl Portrait {
    /// Reads `portrait.json`.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        serde_json::from_slice(&bytes).with_context(|| format!("{} is not a portrait", path.display()))
    }

    /// Distance between two face shapes after similarity alignment: root mean square, in thousandths of the face size.
    pub fn face_distance(&self, other: &Self) -> Option<f64> {
        let fit = similarity(&self.face, &other.face)?;
        let pairs = || self.face.iter().zip(&other.face);
        let sum: f64 = pairs().map(|(a, b)| vec3::norm(vec3::sub(fit.apply(*a), *b)).powi(2)).sum();
        Some(1000.0 * (sum / pairs().count() as f64).sqrt())
    }

    /// Distance of the skin and hair colours: sum of the mean earth mover's distances, in 8-bit steps.
    pub fn colour_distance(&self, other: &Self) -> f64 {
        let distance = |some: &[f32], others: &[f32]| {
            let steps: f32 = some.iter().zip(others).map(|(a, b)| (a - b).abs()).sum();
            256.0 * f64::from(steps) / some.len().max(1) as f64
        };
        distance(&self.skin, &other.skin) + distance(&self.hair, &other.hair)
    }
}
