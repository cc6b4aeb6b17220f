//! Frechet distances of the catalogue: the normal distributions of predicted and of ground-truth rows as packed moments. A row is a
//! single pose, or a window as numbers of a fixed space.

use super::frechet::between;
use super::moments;
use crate::math::vec3::Vec3;
use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::space::fixed_rate;
use crate::metrics::space::fixed_rate::Frames;
use crate::metrics::space::{basis, embedding};
use crate::metrics::sums::BlockSums;
use crate::types::skeleton::N_JOINTS;
use ndarray::{Array2, ArrayView2, ArrayView3};
use serde_json::json;

const CM: f64 = 100.0;

/// Distance of single poses.
struct FrechetPoses {
    part: BodyPart,
    joints: Vec<usize>,
}

/// Of all 48 joints (144 numbers) or of the body (18).
pub(crate) fn poses(part: BodyPart) -> Box<dyn MetricFamily> {
    Box::new(FrechetPoses { part, joints: part.joints() })
}

impl MetricFamily for FrechetPoses {
    fn definitions(&self) -> Vec<Definition> {
        vec![Definition {
            name: "frechet_pose",
            part: self.part.name(),
            unit: "cm^2",
            better: Better::Lower,
            formula: "|m_p - m_g|^2 + trace(C_p + C_g - 2 sqrt(C_p C_g)), m and C mean and unbiased covariance of the rows; a \
                      row is the pose of one frame, x, y, z of all joints of the part in centimetres from the neck; frames \
                      in which not all of them are seen are left out",
            undefined: "fewer than 2 frames have all joints of the part",
            parameters: json!({"n_numbers": 3 * self.joints.len()}),
        }]
    }

    fn n_sums(&self) -> usize {
        2 * moments::packed_len(3 * self.joints.len())
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        let mut frames = vec![Vec::new(); blocks.n()];
        for t in 0..pair.n_frames() {
            if self.joints.iter().all(|joint| pair.seen[t][*joint]) {
                frames[blocks.of(t)].push(t);
            }
        }
        let rows = |poses: &[[Vec3; N_JOINTS]], frames: &[usize]| {
            let shape = (frames.len(), 3 * self.joints.len());
            Array2::from_shape_fn(shape, |(row, i)| CM * poses[frames[row]][self.joints[i / 3]][i % 3])
        };
        for (block, frames) in frames.iter().enumerate() {
            let (predicted, ground_truth) = blocks.row(block).split_at_mut(moments::packed_len(3 * self.joints.len()));
            moments::add(rows(&pair.predicted, frames).view(), predicted);
            moments::add(rows(&pair.ground_truth, frames).view(), ground_truth);
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![distance(sums, 3 * self.joints.len())]
    }

    fn is_costly(&self) -> bool {
        true
    }
}

/// Rows of windows: of joints, mask and frame rate.
type WindowRows = fn(ArrayView3<f32>, ArrayView2<bool>, crate::types::time::FrameRate) -> Array2<f64>;

/// Distance of windows in a fixed space.
struct FrechetSpace {
    name: &'static str,
    formula: &'static str,
    hash: String,
    windows: WindowRows,
    n_frames: usize,
    stride: usize,
    n_numbers: usize,
}

/// Of windows of 15 frames in the fixed basis.
pub(crate) fn basis() -> Box<dyn MetricFamily> {
    Box::new(FrechetSpace {
        name: "frechet_window",
        formula: "|m_p - m_g|^2 + trace(C_p + C_g - 2 sqrt(C_p C_g)), m and C mean and unbiased covariance of the rows; a row \
                  is a window of wholly seen frames at 15 a second (46 joints, weighted centimetres, fingers from their \
                  wrist) as its 64 numbers in the fixed basis (models/motion_basis.md)",
        hash: basis::hash(),
        windows: basis::windows,
        n_frames: basis::WINDOW,
        stride: basis::STRIDE,
        n_numbers: basis::N,
    })
}

/// Of windows in the embedding that is shipped.
pub(crate) fn embedding() -> Box<dyn MetricFamily> {
    Box::new(FrechetSpace {
        name: "frechet_embedding",
        formula: "|m_p - m_g|^2 + trace(C_p + C_g - 2 sqrt(C_p C_g)), m and C mean and unbiased covariance of the rows; a row \
                  is what the shipped encoder (models/motion_embedding.md) makes of a window of wholly seen frames at 15 \
                  a second",
        hash: embedding::hash(),
        windows: embedding::windows,
        n_frames: embedding::WINDOW,
        stride: embedding::STRIDE,
        n_numbers: embedding::N,
    })
}

impl MetricFamily for FrechetSpace {
    fn definitions(&self) -> Vec<Definition> {
        vec![Definition {
            name: self.name,
            part: "all",
            unit: "1",
            better: Better::Lower,
            formula: self.formula,
            undefined: "fewer than 2 windows are wholly seen",
            parameters: json!({
                "n_frames": self.n_frames, "stride": self.stride, "n_numbers": self.n_numbers, "space": self.hash,
            }),
        }]
    }

    fn n_sums(&self) -> usize {
        2 * moments::packed_len(self.n_numbers)
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        let interval = &pair.interval;
        // what one of both lacks is left out of both
        let mut mask = interval.mask.to_owned();
        for ((t, joint), seen) in mask.indexed_iter_mut() {
            *seen &= pair.seen.get(t).is_some_and(|seen| seen.get(joint) == Some(&true));
        }
        let starts = Frames::new(interval.ground_truth, mask.view(), interval.fps).starts(self.n_frames, self.stride);
        let length = moments::packed_len(self.n_numbers);
        for (i, joints) in [interval.predicted, interval.ground_truth].into_iter().enumerate() {
            let rows = (self.windows)(joints, mask.view(), interval.fps);
            if rows.nrows() != starts.len() {
                // a predicted joint that is not finite breaks its window
                blocks.at(0)[i * length] = f64::NAN;
                continue;
            }
            for (row, start) in rows.outer_iter().zip(&starts) {
                let t = (*start as f64 / fixed_rate::FPS.per_sec() * pair.fps) as usize;
                let own = &mut blocks.at(t)[i * length..(i + 1) * length];
                moments::add(row.insert_axis(ndarray::Axis(0)), own);
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![distance(sums, self.n_numbers)]
    }

    fn is_costly(&self) -> bool {
        true
    }
}

/// Of two packed moments of rows of `d` numbers, one after the other.
fn distance(sums: &[f64], d: usize) -> f64 {
    let (predicted, ground_truth) = sums.split_at(moments::packed_len(d));
    match (moments::read(predicted, d), moments::read(ground_truth, d)) {
        (Some((_, of_made, predicted)), Some((_, of_real, ground_truth))) => {
            between((&of_made, &predicted), (&of_real, &ground_truth))
        }
        _ => f64::NAN,
    }
}
