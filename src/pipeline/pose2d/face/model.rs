//! The face model: 468 points of the face in a rotated square, and how sure it is that there is one.

use super::landmarks::{FacePoint, N_LANDMARKS};
use crate::pose2d::decode::points;
use crate::pose2d::model_input::ModelInput;
use anyhow::{Result, bail, ensure};
use orator_base::types::image::Image;
use orator_media::opencv::warp::Region;
use orator_onnx::{Decode, ModelEntry, Runtime};
use std::path::Path;

/// One face.
pub struct DetectedFace {
    /// 468 points.
    pub points: Vec<FacePoint>,
    /// 0..1.
    pub score: f64,
}

/// The face model with its way of reading.
pub struct FaceModel {
    pub feed: ModelInput,
    decode: Decode,
}

impl FaceModel {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        Ok(Self { feed: ModelInput::open(runtime, entry, dir)?, decode: entry.decode.clone() })
    }

    /// The face in the square; None where the square is no place in a picture or the model's numbers are none.
    pub fn find(&mut self, image: &Image, region: &Region) -> Result<Option<DetectedFace>> {
        let size = self.feed.size()[0];
        let Some(src_from_dst) = region.src_from_dst(size) else { return Ok(None) };
        let outputs = self.feed.part(image, &src_from_dst)?;
        let Decode::Regression { landmarks, score, logit, .. } = &self.decode else {
            bail!("a face cannot be read as {:?}", self.decode)
        };
        let score = outputs.floats(score)?.1.first().copied().unwrap_or(f32::NAN);
        let score = points::regression_score(score, *logit);
        let numbers = outputs.floats(landmarks)?.1;
        ensure!(numbers.len() == 3 * N_LANDMARKS, "{} numbers are no {N_LANDMARKS} points of a face", numbers.len());
        if !score.is_finite() || numbers.iter().any(|number| !number.is_finite()) {
            return Ok(None);
        }
        let px = region.side / size as f64;
        let place = |row: &[f32]| {
            let [x, y] = src_from_dst.apply([f64::from(row[0]), f64::from(row[1])]);
            [x, y, f64::from(row[2]) * px]
        };
        Ok(Some(DetectedFace { points: numbers.chunks_exact(3).map(place).collect(), score: f64::from(score) }))
    }
}
