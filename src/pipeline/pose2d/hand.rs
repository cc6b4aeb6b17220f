//! Hand model: 21 points of the hand in a rotated square, the presence score, the handedness if the model predicts it.

use super::body::{PointReader, map_points};
use super::decode::{ScoredPoint, points};
use super::model_input::ModelInput;
use super::region;
use anyhow::Result;
use orator_base::types::image::Image;
use orator_media::opencv::warp::Region;
use orator_onnx::{Decode, ModelEntry, Runtime};
use std::path::Path;

/// One hand in px of the picture.
#[derive(Clone, Debug)]
pub struct DetectedHand {
    pub points: [ScoredPoint; 21],
    /// Presence score, 0..1; the mean score of the points if the model has none.
    pub score: f64,
    /// Probability that it is a right hand.
    pub right: Option<f64>,
    /// Depth of the points relative to the wrist, away from the camera; `None` if the model gives none.
    pub depth: Option<[f64; 21]>,
}

impl DetectedHand {
    pub fn from_points(points: [ScoredPoint; 21]) -> Self {
        Self { score: points.iter().map(|point| point[2]).sum::<f64>() / 21.0, points, right: None, depth: None }
    }

    /// Coordinates x, y of the points.
    pub fn positions(&self) -> [[f64; 2]; 21] {
        self.points.map(|[x, y, _]| [x, y])
    }

    /// Square to search in the next frame.
    pub fn next_region(&self) -> Region {
        region::around_hand(&self.positions())
    }
}

pub struct HandModel {
    pub input: ModelInput,
    reader: PointReader,
    decode: Decode,
    map: Vec<usize>,
}

impl HandModel {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        let (reader, map) = (PointReader::new(&entry.decode), entry.points.hand.clone());
        Ok(Self { input: ModelInput::open(runtime, entry, dir)?, reader, decode: entry.decode.clone(), map })
    }

    /// Hand in the square; `None` if the square is degenerate or the outputs are not finite.
    pub fn find(&mut self, image: &Image, region: &Region) -> Result<Option<DetectedHand>> {
        let size = self.input.size();
        let Some(src_from_dst) = region.src_from_dst(size[0]) else { return Ok(None) };
        let outputs = self.input.run_crop(image, &src_from_dst)?;
        let single = |name: &str| -> Result<f32> { Ok(outputs.floats(name)?.1.first().copied().unwrap_or(0.0)) };
        let hand = if let Decode::Regression { landmarks, score, logit, right } = &self.decode {
            let score = points::regression_score(single(score)?, *logit);
            let n_points = self.map.iter().max().map_or(0, |largest| largest + 1);
            let landmarks = outputs.floats(landmarks)?.1;
            let points = points::regression(landmarks, score, n_points.max(21))?;
            let depth = points::depths(landmarks, points.len()).map(|depths| {
                let px = src_from_dst.scale();
                let at = |point: usize| px * self.map.get(point).and_then(|at| depths.get(*at)).unwrap_or(&0.0);
                std::array::from_fn(|point| at(point) - at(0))
            });
            let right = right.as_ref().map(|name| single(name)).transpose()?.map(f64::from);
            let points = map_points(&points, &self.map, &src_from_dst);
            DetectedHand { points, score: f64::from(score), right, depth }
        } else {
            DetectedHand::from_points(map_points(&self.reader.points(&outputs, size)?, &self.map, &src_from_dst))
        };
        Ok((hand.score > 0.0 && hand.score.is_finite()).then_some(hand))
    }
}
