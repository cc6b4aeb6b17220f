//! Face model: 468 points of the face in a rotated square, and the presence score.

use super::landmarks::{FacePoint, N_LANDMARKS};
use crate::pose2d::decode::points;
use crate::pose2d::model_input::ModelInput;
use anyhow::{Result, bail, ensure};
use orator_base::types::image::Image;
use orator_media::opencv::warp::Region;
use orator_onnx::{Decode, ModelEntry, Runtime};
use std::path::Path;

pub struct DetectedFace {
    /// The 468 landmarks.
    pub points: Vec<FacePoint>,
    /// Presence score, 0..1.
    pub score: f64,
}

pub struct FaceModel {
    pub input: ModelInput,
    decode: Decode,
}

impl FaceModel {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        Ok(Self { input: ModelInput::open(runtime, entry, dir)?, decode: entry.decode.clone() })
    }

    /// Face in the square; `None` if the square is degenerate or the outputs are not finite.
    pub fn find(&mut self, image: &Image, region: &Region) -> Result<Option<DetectedFace>> {
        let size = self.input.size()[0];
        let Some(src_from_dst) = region.src_from_dst(size) else { return Ok(None) };
        let outputs = self.input.run_crop(image, &src_from_dst)?;
        let Decode::Regression { landmarks, score, logit, .. } = &self.decode else {
            bail!("a face model cannot have outputs of the kind {:?}", self.decode)
        };
        let score = outputs.floats(score)?.1.first().copied().unwrap_or(f32::NAN);
        let score = points::regression_score(score, *logit);
        let values = outputs.floats(landmarks)?.1;
        ensure!(
            values.len() == 3 * N_LANDMARKS,
            "{} values of face landmarks, expected 3 for each of {N_LANDMARKS}",
            values.len()
        );
        if !score.is_finite() || values.iter().any(|number| !number.is_finite()) {
            return Ok(None);
        }
        let scale = region.side / size as f64;
        let to_picture = |row: &[f32]| {
            let [x, y] = src_from_dst.apply([f64::from(row[0]), f64::from(row[1])]);
            [x, y, f64::from(row[2]) * scale]
        };
        Ok(Some(DetectedFace { points: values.chunks_exact(3).map(to_picture).collect(), score: f64::from(score) }))
    }
}
