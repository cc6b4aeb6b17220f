//! Ground truth of a demo video at the dataset rate, for either speaker: the figure in a marker suit or the rendered
//! person.

use crate::rendered_truth::{BODY_JOINTS, RenderedTruth, Visibility};
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3, Axis, s};
use orator_base::math::order::median;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_SHOULDER, R_SHOULDER};
use orator_formats::npz::Npz;
use orator_test_support::drawn::folder::DATASET_FPS;
use orator_test_support::drawn::truth::DrawnTruth;
use std::path::Path;

/// Number of body points that are compared: COCO without legs.
const N_BODY: usize = 13;

/// Ground truth of a video.
pub struct DemoTruth {
    /// Ground truth; points that are not visible are NaN.
    pub drawn: DrawnTruth,
    /// Median shoulder width of a rendered person at the neck's distance, px; `None`: the marker suit.
    pub shoulders_px: Option<f64>,
}

impl DemoTruth {
    /// Reads the ground truth of either speaker.
    ///
    /// # Errors
    /// A frame rate that is not the dataset's (marker suit) or not a multiple of it (rendered person); an invalid
    /// file.
    pub fn read(path: &Path) -> Result<Self> {
        if !Npz::open(path)?.has(BODY_JOINTS) {
            let drawn = DrawnTruth::read(path)?;
            let fps = drawn.motion.fps;
            ensure!(
                fps == DATASET_FPS,
                "invalid frame rate of {}: expected {DATASET_FPS}, found {fps}",
                path.display()
            );
            return Ok(Self { drawn, shoulders_px: None });
        }
        let truth = RenderedTruth::read(path)?;
        let step = truth.fps.per_sec() / DATASET_FPS.per_sec();
        ensure!(
            step >= 1.0 && step.fract() == 0.0,
            "invalid frame rate of {}: expected a multiple of {DATASET_FPS}, found {}; draw the demo with `--fps 30`",
            path.display(),
            truth.fps
        );
        Ok(Self::from_rendered(&truth, step as usize))
    }

    fn from_rendered(truth: &RenderedTruth, step: usize) -> Self {
        let frames: Vec<usize> = (0..truth.n_frames()).step_by(step.max(1)).collect();
        let visible = |px: &Array3<f32>, seen: &Array2<Visibility>| {
            let (mut px, seen) = (px.select(Axis(0), &frames), seen.select(Axis(0), &frames));
            for ((t, point), seen) in seen.indexed_iter() {
                if *seen != Visibility::Visible {
                    px.slice_mut(s![t, point, ..]).fill(f32::NAN);
                }
            }
            px
        };
        let joints = truth.joints.select(Axis(0), &frames);
        let shoulders = frames.iter().zip(joints.outer_iter()).map(|(&t, frame)| {
            let squared = |k: usize| (frame[[L_SHOULDER, k]] - frame[[R_SHOULDER, k]]).powi(2);
            let metres = (0..3).map(squared).sum::<f32>().sqrt();
            f64::from(truth.focal_px * metres / truth.neck[[t, 2]].max(0.05))
        });
        let shoulders_px = median(shoulders);
        let body = visible(&truth.body, &truth.body_visibility).slice(s![.., ..N_BODY, ..]).to_owned();
        let drawn = DrawnTruth {
            motion: Motion::from_joints(DATASET_FPS, joints),
            body,
            left_hand: visible(&truth.left_hand, &truth.left_hand_visibility),
            right_hand: visible(&truth.right_hand, &truth.right_hand_visibility),
        };
        Self { drawn, shoulders_px }
    }
}
