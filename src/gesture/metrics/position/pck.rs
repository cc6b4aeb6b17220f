//! Percentage of correct keypoints, PCK (Ginosar et al. 2019, section 5; Rebol et al. 2021): a joint is correct if its
//! distance from the ground truth is at most alpha times the largest extent of the real pose. `CorrectKeypoints` uses
//! an alpha of 0.2 for training; the metrics support any alpha, in the image plane and in 3D.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use ndarray::{ArrayView2, ArrayView3, NdFloat};
use orator_base::types::skeleton::{L_WRIST, N_JOINTS, NECK, R_SHOULDER, is_duplicate};
use serde_json::json;

/// Tolerance of a correct joint as a share of the largest extent of the pose.
pub const ALPHA: f32 = 0.2;

/// Numbers of correct and of all keypoints of one part of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeypointCount {
    pub n_correct: usize,
    pub n: usize,
}

/// Numbers of correct and of all keypoints by part of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CorrectKeypoints {
    /// Published metric: every joint but the neck, including the two hand roots, which duplicate the wrists.
    pub all: KeypointCount,
    /// Shoulders, elbows and wrists.
    pub body: KeypointCount,
    /// Joints of both hands except their roots.
    pub hands: KeypointCount,
}

/// Axes in which distances and extents are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PckAxes {
    /// Image plane, as in the first publication.
    Xy,
    /// 3D space.
    Xyz,
}

impl KeypointCount {
    /// Share of correct keypoints, 0..1; 0 if there are none.
    pub fn share(&self) -> f64 {
        self.n_correct as f64 / self.n.max(1) as f64
    }

    fn add(&mut self, correct: bool) {
        self.n_correct += usize::from(correct);
        self.n += 1;
    }
}

pub(crate) fn metric(axes: &[PckAxes], parts: &[BodyPart], alphas: &[f64]) -> MetricFamily {
    let mut variants = Vec::new();
    for axes in axes {
        for alpha in alphas {
            variants.extend(parts.iter().map(|part| (*axes, *part, *alpha)));
        }
    }
    family(variants, false, false)
}

/// PCK of speech2gesture (Ginosar et al. 2019, `common/evaluation.py` in their repository): every frame has the same
/// weight for any number of visible joints.
pub(crate) fn by_frame(alphas: &[f64]) -> MetricFamily {
    family(alphas.iter().map(|alpha| (PckAxes::Xy, BodyPart::All, *alpha)).collect(), false, true)
}

/// PCK in 3D of all joints, with the neck included in the bounding box.
pub(crate) fn neck_in_box(alphas: &[f64]) -> MetricFamily {
    family(alphas.iter().map(|alpha| (PckAxes::Xyz, BodyPart::All, *alpha)).collect(), true, false)
}

fn family(variants: Vec<(PckAxes, BodyPart, f64)>, neck_in_box: bool, by_frame: bool) -> MetricFamily {
    let definition = |(axes, part, alpha): &(PckAxes, BodyPart, f64)| {
        let (name, formula) = match axes {
            PckAxes::Xy if by_frame => (
                "pck_2d",
                "mean over frames of the share of the 48 joints without the neck with |p - g| <= alpha * max(width, \
                 height) of the box around those of g in the frame; x and y alone; metres, not scaled to another \
                 speaker (a scale cancels); not seen joints left out",
            ),
            PckAxes::Xyz if neck_in_box => (
                "pck_3d_neck_in_box",
                "share of all seen joints of the part in all frames with |p - g| <= alpha * the largest of the sides \
                 x, y, z of the box around all seen joints of g in the frame, the neck among them; a made joint that \
                 is not finite is wrong",
            ),
            PckAxes::Xyz => (
                "pck_3d",
                "share of all seen joints of the part in all frames with |p - g| <= alpha * the largest of the sides \
                 x, y, z of the box around all seen joints of g in the frame but the neck, whatever the part; a made \
                 joint that is not finite is wrong",
            ),
            PckAxes::Xy => (
                "pck_2d",
                "share of all seen joints of the part in all frames with |p - g| <= alpha * the larger of the sides \
                 x, y of the box around all seen joints of g in the frame but the neck, whatever the part; distances \
                 in x and y alone; a made joint that is not finite is wrong",
            ),
        };
        let (part, undefined) = (part.name(), "no joint of the part is visible");
        let parameters = json!({"alpha": alpha});
        Definition { name, part, unit: "1", better: Better::Higher, formula, undefined, parameters }
    };
    let definitions: Vec<Definition> = variants.iter().map(definition).collect();
    let variants: Vec<_> = variants.into_iter().map(|(axes, part, alpha)| (axes, part.joints(), alpha)).collect();
    let first_boxed = if neck_in_box { NECK } else { NECK + 1 };
    let measure = move |pair: &PairedFrames, blocks: &mut BlockSums| {
        for t in 0..pair.n_frames() {
            let (predicted, ground_truth, visible) = (&pair.predicted[t], &pair.ground_truth[t], &pair.visible[t]);
            for (row, (axes, joints, alpha)) in blocks.at(t).chunks_exact_mut(2).zip(&variants) {
                let boxed = (first_boxed..N_JOINTS).filter(|joint| visible[*joint]);
                let radius = alpha * extent(*axes, boxed, |joint, k| ground_truth[joint][k]);
                let n_visible = joints.iter().filter(|joint| visible[**joint]).count();
                let weight = if by_frame { 1.0 / n_visible as f64 } else { 1.0 };
                for &joint in joints.iter().filter(|joint| visible[**joint]) {
                    let correct = distance(*axes, |k| predicted[joint][k], |k| ground_truth[joint][k]) <= radius;
                    row[0] += if correct { weight } else { 0.0 };
                    row[1] += weight;
                }
            }
        }
    };
    let values = |sums: &[f64]| sums.chunks_exact(2).map(|row| row[0] / row[1]).collect();
    MetricFamily::new(definitions.clone(), 2 * definitions.len(), measure, values)
}

impl PckAxes {
    fn n(self) -> usize {
        match self {
            Self::Xy => 2,
            Self::Xyz => 3,
        }
    }
}

/// Largest side of the bounding box of these joints of a pose.
fn extent<F: NdFloat>(
    axes: PckAxes,
    joints: impl Iterator<Item = usize> + Clone,
    pose: impl Fn(usize, usize) -> F,
) -> F {
    let side = |k: usize| {
        let values = joints.clone().map(|joint| pose(joint, k));
        let (low, high) = values.fold((F::infinity(), F::neg_infinity()), |(low, high), v| (low.min(v), high.max(v)));
        high - low
    };
    (0..axes.n()).map(side).fold(F::zero(), F::max)
}

/// Distance of two points, given by functions `a` and `b` that return coordinate k.
fn distance<F: NdFloat>(axes: PckAxes, a: impl Fn(usize) -> F, b: impl Fn(usize) -> F) -> F {
    (0..axes.n()).map(|k| (a(k) - b(k)).powi(2)).fold(F::zero(), |sum, square| sum + square).sqrt()
}

impl CorrectKeypoints {
    /// Share of correct keypoints of all joints, 0..1.
    pub fn share(&self) -> f64 {
        self.all.share()
    }

    /// Counts the joints of `predicted` [T, 49, 3] against `ground_truth` [T, 49, 3], both in metres, where `mask` [T,
    /// 49] is true. A joint is correct if its distance is at most `ALPHA` times the largest side of the bounding box of
    /// all visible real joints of the frame except the neck, both in these axes. The radius is the same for all parts.
    /// A predicted joint that is not finite is wrong.
    pub fn count(
        &mut self,
        axes: PckAxes,
        predicted: ArrayView3<f32>,
        ground_truth: ArrayView3<f32>,
        mask: ArrayView2<bool>,
    ) {
        for ((predicted, ground_truth), mask) in
            predicted.outer_iter().zip(ground_truth.outer_iter()).zip(mask.outer_iter())
        {
            let visible: Vec<usize> = (NECK + 1..N_JOINTS).filter(|joint| mask[*joint]).collect();
            let radius = ALPHA * extent(axes, visible.iter().copied(), |joint, k| ground_truth[[joint, k]]);
            for joint in visible {
                let correct = distance(axes, |k| predicted[[joint, k]], |k| ground_truth[[joint, k]]) <= radius;
                self.all.add(correct);
                match joint {
                    R_SHOULDER..=L_WRIST => self.body.add(correct),
                    _ if !is_duplicate(joint) => self.hands.add(correct),
                    _ => {}
                }
            }
        }
    }
}
