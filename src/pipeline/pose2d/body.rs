//! Body model: keypoints of the person in a box, and of both hands if the model predicts them.

use super::decode::{ScoredPoint, heatmap, points};
use super::model_input::ModelInput;
use anyhow::{Result, bail};
use orator_base::types::image::Image;
use orator_media::opencv::blur::GaussianBlur;
use orator_media::opencv::warp::SrcFromDst;
use orator_onnx::{Decode, KeypointOutputs, ModelEntry, Outputs, PictureFit, Refine, Runtime};
use std::path::Path;

/// Decoder of outputs with one position per keypoint: heatmaps or SimCC.
pub struct PointReader {
    decode: Decode,
    gaussian: GaussianBlur,
}

impl PointReader {
    pub fn new(decode: &Decode) -> Self {
        let width = if let Decode::Heatmap { blur, refine: Refine::Dark, .. } = decode { *blur } else { 1 };
        Self { decode: decode.clone(), gaussian: GaussianBlur::new(width) }
    }

    /// All predicted points in px of the model input; `size` is its height and width.
    pub fn points(&self, outputs: &Outputs, size: [usize; 2]) -> Result<Vec<ScoredPoint>> {
        match &self.decode {
            Decode::Heatmap { heatmap: name, refine, .. } => {
                let (shape, maps) = outputs.floats(name)?;
                heatmap::decode(shape, maps, size, *refine, &self.gaussian)
            }
            Decode::Simcc { x, y, split } => points::simcc(outputs.floats(x)?, outputs.floats(y)?, *split),
            other => bail!("a body model cannot have outputs of the kind {other:?}"),
        }
    }
}

/// Selects the points listed in `map` and transforms them to picture coordinates; missing points are zero.
pub fn map_points<const N: usize>(
    points: &[ScoredPoint],
    map: &[usize],
    src_from_dst: &SrcFromDst,
) -> [ScoredPoint; N] {
    std::array::from_fn(|at| {
        let [x, y, score] = map.get(at).and_then(|from| points.get(*from)).copied().unwrap_or_default();
        let [x, y] = src_from_dst.apply([x, y]);
        if score > 0.0 { [x, y, score] } else { [0.0; 3] }
    })
}

/// Output of the body model for one person, in px of the picture.
pub struct DetectedBody {
    pub points: [ScoredPoint; 17],
    /// Left and right hand, if a whole-body model predicts them.
    pub hands: Option<[[ScoredPoint; 21]; 2]>,
}

pub struct BodyModel {
    pub input: ModelInput,
    reader: PointReader,
    margin: f64,
    map: KeypointOutputs,
}

impl BodyModel {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        let margin = if let PictureFit::Box { margin } = entry.fit { margin } else { 1.0 };
        let (reader, map) = (PointReader::new(&entry.decode), entry.points.clone());
        Ok(Self { input: ModelInput::open(runtime, entry, dir)?, reader, margin, map })
    }

    pub fn gives_hands(&self) -> bool {
        !self.map.left_hand.is_empty()
    }

    /// Keypoints of the person in the box (x, y, width, height in px); `None` for an invalid box.
    pub fn find(&mut self, image: &Image, bbox: [f64; 4]) -> Result<Option<DetectedBody>> {
        let size = self.input.size();
        let Some(src_from_dst) = crop_transform(bbox, size, self.margin) else { return Ok(None) };
        let outputs = self.input.run_crop(image, &src_from_dst)?;
        let points = self.reader.points(&outputs, size)?;
        let hand = |map: &[usize]| map_points::<21>(&points, map, &src_from_dst);
        let hands = (!self.map.left_hand.is_empty()).then(|| [hand(&self.map.left_hand), hand(&self.map.right_hand)]);
        Ok(Some(DetectedBody { points: map_points(&points, &self.map.body, &src_from_dst), hands }))
    }
}

/// Transform of a crop of `[height, width]` px around a box, extended on its short side to the aspect ratio of the
/// crop, then scaled by `margin`. `None` if the result is degenerate or far outside any picture.
fn crop_transform([x, y, width, height]: [f64; 4], size: [usize; 2], margin: f64) -> Option<SrcFromDst> {
    let [rows, columns] = size.map(|px| px as f64);
    let centre = [x + width / 2.0, y + height / 2.0];
    let scale = (width / columns).max(height / rows) * margin;
    let is_valid = scale.is_finite() && scale > 1e-6 && scale < 1e4 && centre.iter().all(|px| px.abs() < 1e6);
    is_valid.then(|| {
        SrcFromDst([[scale, 0.0, centre[0] - scale * columns / 2.0], [0.0, scale, centre[1] - scale * rows / 2.0]])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_grows_to_the_inputs_shape_around_its_centre() {
        for bbox in [[10.0, 20.0, 30.0, 200.0], [10.0, 20.0, 300.0, 20.0]] {
            let transform = crop_transform(bbox, [256, 192], 1.25).unwrap();
            let centre = transform.apply([96.0, 128.0]);
            assert!((centre[0] - bbox[0] - bbox[2] / 2.0).abs() < 1e-9);
            assert!((centre[1] - bbox[1] - bbox[3] / 2.0).abs() < 1e-9);
            let scale = transform.0[0][0];
            assert!((scale * 192.0 >= bbox[2] * 1.25 - 1e-9) && (scale * 256.0 >= bbox[3] * 1.25 - 1e-9));
        }
        assert!(crop_transform([f64::NAN; 4], [256, 192], 1.25).is_none());
        assert!(crop_transform([0.0; 4], [256, 192], 1.25).is_none());
    }

    #[test]
    fn mapped_points_are_transformed_and_missing_ones_are_zero() {
        let transform = SrcFromDst([[2.0, 0.0, 1.0], [0.0, 2.0, 0.0]]);
        let points = [[1.0, 1.0, 0.5], [4.0, 5.0, 0.9], [7.0, 7.0, 0.0]];
        assert_eq!(
            map_points::<4>(&points, &[1, 0, 2, 9], &transform),
            [[9.0, 10.0, 0.9], [3.0, 2.0, 0.5], [0.0; 3], [0.0; 3]]
        );
    }
}
