//! What the rules look at: a few numbers a frame. They are written beside the verdict (`measures.npz`), so that
//! thresholds can be judged anew without looking at the video or the keypoints again.

use crate::types::pose2d::{Keypoints, coco};
use anyhow::{Context, Result};
use ndarray::{Array1, ArrayView2, ArrayView3};
use ndarray_npy::NpzWriter;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Per frame, all of the same length T.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measures {
    /// Best score of a face or arm point: whether somebody is there.
    pub person: Vec<f32>,
    /// Distance between the shoulders, px.
    pub shoulder_px: Vec<f32>,
    /// Score of the nose or of the better eye, whichever is lower.
    pub face: Vec<f32>,
    /// Lowest score of shoulders and elbows. A wrist belongs to its hand: both leave the picture together.
    pub arms: Vec<f32>,
    /// Mean score of a hand's points.
    pub left_hand: Vec<f32>,
    pub right_hand: Vec<f32>,
    /// Way of the neck since the frame before, in shoulder widths (the wider of the two frames); 0 in frame 0.
    pub jump: Vec<f32>,
    /// Number of the shot.
    pub shot: Vec<i64>,
}

impl Measures {
    /// Measures keypoints; `shot` has one number a frame.
    pub fn of(keypoints: &Keypoints, shot: Vec<i64>) -> Self {
        let mut measures = Self { shot, ..Self::default() };
        let mut before: Option<([f32; 2], f32)> = None;
        for body in keypoints.body.outer_iter() {
            let score = |joint: usize| body[[joint, 2]];
            let arms = [coco::L_SHOULDER, coco::R_SHOULDER, coco::L_ELBOW, coco::R_ELBOW].map(score);
            let face = score(coco::NOSE).min(score(coco::L_EYE).max(score(coco::R_EYE)));
            measures.person.push(arms.into_iter().fold(score(coco::NOSE), f32::max));
            measures.face.push(face);
            measures.arms.push(arms.into_iter().fold(f32::INFINITY, f32::min));
            let (neck, width) = shoulders(body);
            let way = before.map_or(0.0, |(old, old_width)| {
                let way = (neck[0] - old[0]).hypot(neck[1] - old[1]);
                if way == 0.0 { 0.0 } else { way / width.max(old_width).max(1.0) }
            });
            measures.shoulder_px.push(width);
            measures.jump.push(way);
            before = Some((neck, width));
        }
        measures.left_hand = mean_scores(keypoints.left_hand.view());
        measures.right_hand = mean_scores(keypoints.right_hand.view());
        measures
    }

    /// Number of frames T.
    pub fn n_frames(&self) -> usize {
        self.shot.len()
    }

    /// Writes `measures.npz`: the arrays by their names.
    pub fn write(&self, path: &Path) -> Result<()> {
        let written = || -> Result<()> {
            let mut npz = NpzWriter::new(BufWriter::new(File::create(path)?));
            let arrays = [
                ("person", &self.person),
                ("shoulder_px", &self.shoulder_px),
                ("face", &self.face),
                ("arms", &self.arms),
                ("left_hand", &self.left_hand),
                ("right_hand", &self.right_hand),
                ("jump", &self.jump),
            ];
            for (name, values) in arrays {
                npz.add_array(name, &Array1::from_vec(values.clone()))?;
            }
            npz.add_array("shot", &Array1::from_vec(self.shot.clone()))?;
            npz.finish()?;
            Ok(())
        };
        written().with_context(|| format!("cannot write {}", path.display()))
    }
}

/// The number of each frame's shot, from 0: a frame whose score reaches `threshold` begins a new one.
pub fn shot_numbers(scores: impl IntoIterator<Item = f64>, threshold: f64) -> Vec<i64> {
    let begins = |score: f64| i64::from(score > 0.0 && score >= threshold);
    let mut number = 0;
    let next = |score| {
        number += begins(score);
        number
    };
    scores.into_iter().map(next).collect()
}

/// The point between the shoulders, and the distance between them, in px.
fn shoulders(body: ArrayView2<f32>) -> ([f32; 2], f32) {
    let at = |joint: usize| [body[[joint, 0]], body[[joint, 1]]];
    let (left, right) = (at(coco::L_SHOULDER), at(coco::R_SHOULDER));
    let neck = [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0];
    (neck, (left[0] - right[0]).hypot(left[1] - right[1]))
}

fn mean_scores(hand: ArrayView3<f32>) -> Vec<f32> {
    let n_points = hand.shape()[1].max(1) as f32;
    hand.outer_iter().map(|points| points.column(2).sum() / n_points).collect()
}
