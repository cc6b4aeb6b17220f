//! Per-frame measures that the rules use. They are stored in `measures.npz`, so that thresholds can be re-evaluated
//! without processing the video or keypoints again.

use super::rest;
use ndarray::{ArrayView2, ArrayView3};
use orator_base::types::pose2d::{Keypoints, VISIBLE_SCORE, coco};

/// Limit of `facing` and `nose_off`, whose denominators may vanish.
const MAX_RATIO: f32 = 10.0;

/// Neck movement since the previous frame, in shoulder widths, below which an identity change is ignored.
const MIN_JUMP: f32 = 0.2;

/// Measures per frame, all of equal length. NaN: unknown, and no reason to reject the frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measures {
    /// 1 if there is audio, 0 without an audio track or after its end.
    pub sound: Vec<f32>,
    /// Loudness of the second around the frame, dB of full scale.
    pub sound_db: Vec<f32>,
    /// Share of speech in the seconds around the frame, 0..1; NaN if speech is detected by loudness only.
    pub speech: Vec<f32>,
    /// Probability that the voice is that of the visible mouth, 0..1.
    pub lip_sync: Vec<f32>,
    /// Mean change of the picture since the previous frame, in 8-bit steps.
    pub frame_difference: Vec<f32>,
    /// Largest score of a nose or arm point: whether a person is visible.
    pub person: Vec<f32>,
    /// Distance between the shoulders, px.
    pub shoulder_px: Vec<f32>,
    /// Lower of the nose score and the better eye score.
    pub face: Vec<f32>,
    /// Horizontal distance of the left shoulder to the right of the right one in the picture, relative to the distance
    /// from neck to nose: about 2 from the front, 0 from the side, negative from behind.
    pub facing: Vec<f32>,
    /// Horizontal distance of the nose from the neck, in half shoulder widths: above 1 it is outside the shoulders.
    pub nose_off: Vec<f32>,
    /// Lowest score of shoulders and elbows. Wrists are covered by the hands, since both leave the picture together.
    pub arms: Vec<f32>,
    /// Mean score of the points of each hand.
    pub left_hand: Vec<f32>,
    pub right_hand: Vec<f32>,
    /// Share of a hand's gap in which a duplicate of the other hand was detected in its place; 0 outside gaps.
    pub left_other: Vec<f32>,
    pub right_other: Vec<f32>,
    /// Movement of the wrists in the second around the frame, in shoulder widths, if they are together; 10 otherwise.
    pub rest: Vec<f32>,
    pub n_persons: Vec<f32>,
    /// Movement of the neck since the previous frame, in shoulder widths (the wider of the two frames); 0 in frame 0.
    pub jump: Vec<f32>,
    /// 1 if the followed person differs from the previous frame, 0 otherwise.
    pub identity: Vec<f32>,
    /// Shot score, 0..1: how likely the frame is the first of a shot.
    pub shot_score: Vec<f32>,
}

impl Measures {
    /// Measures keypoints. The other measures are set to those of one shot of one moving, speaking person.
    pub fn from_keypoints(keypoints: &Keypoints) -> Self {
        let mut measures = Self::default();
        let mut before: Option<([f32; 2], f32)> = None;
        for body in keypoints.body.outer_iter() {
            let score = |joint: usize| body[[joint, 2]];
            let arms = [coco::L_SHOULDER, coco::R_SHOULDER, coco::L_ELBOW, coco::R_ELBOW].map(score);
            let face = score(coco::NOSE).min(score(coco::L_EYE).max(score(coco::R_EYE)));
            measures.person.push(arms.into_iter().fold(score(coco::NOSE), f32::max));
            measures.face.push(face);
            measures.arms.push(arms.into_iter().fold(f32::INFINITY, f32::min));
            let (neck, width) = shoulders(&body);
            let known = arms[0].min(arms[1]) >= VISIBLE_SCORE;
            let [facing, nose_off] = if known { facing_and_nose_off(&body, neck) } else { [f32::NAN; 2] };
            measures.facing.push(facing);
            measures.nose_off.push(nose_off);
            let now = known.then_some((neck, width));
            measures.jump.push(if measures.jump.is_empty() { 0.0 } else { neck_distance(before, now) });
            measures.shoulder_px.push(width);
            before = now;
        }
        let n_frames = keypoints.n_frames();
        Self {
            sound: vec![1.0; n_frames],
            sound_db: vec![0.0; n_frames],
            speech: vec![1.0; n_frames],
            lip_sync: vec![1.0; n_frames],
            frame_difference: vec![255.0; n_frames],
            left_hand: mean_scores(&keypoints.left_hand.view()),
            right_hand: mean_scores(&keypoints.right_hand.view()),
            left_other: vec![0.0; n_frames],
            right_other: vec![0.0; n_frames],
            rest: rest::movement(keypoints),
            n_persons: vec![1.0; n_frames],
            identity: vec![0.0; n_frames],
            shot_score: vec![0.0; n_frames],
            ..measures
        }
    }

    pub fn n_frames(&self) -> usize {
        self.person.len()
    }
}

/// Frames at which the identity changes and the neck moves (`jump`): another person is never at the same position one
/// frame later. Identity changes at restarts of tracking are left to the shot rule.
pub fn identity(numbers: &[i64], restart: &[bool], jump: &[f32]) -> Vec<f32> {
    let stays = |t: usize| {
        restart.get(t).copied().unwrap_or(false) || jump.get(t).is_some_and(|&neck_distance| neck_distance < MIN_JUMP)
    };
    let changed = |t: usize| t > 0 && numbers[t] != numbers[t - 1] && !stays(t);
    (0..numbers.len()).map(|t| f32::from(u8::from(changed(t)))).collect()
}

/// Midpoint of the shoulders and their distance, px.
fn shoulders(body: &ArrayView2<f32>) -> ([f32; 2], f32) {
    let (left, right) = (at(body, coco::L_SHOULDER), at(body, coco::R_SHOULDER));
    let neck = [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0];
    (neck, (left[0] - right[0]).hypot(left[1] - right[1]))
}

/// `facing` and `nose_off` of a frame with visible shoulders.
fn facing_and_nose_off(body: &ArrayView2<f32>, neck: [f32; 2]) -> [f32; 2] {
    if body[[coco::NOSE, 2]] < VISIBLE_SCORE {
        return [f32::NAN; 2];
    }
    let nose = at(body, coco::NOSE);
    let width = at(body, coco::L_SHOULDER)[0] - at(body, coco::R_SHOULDER)[0];
    let height = (nose[0] - neck[0]).hypot(nose[1] - neck[1]);
    let ratio = |a: f32, b: f32| (a / b.max(1e-3)).clamp(-MAX_RATIO, MAX_RATIO);
    [ratio(width, height), ratio((nose[0] - neck[0]).abs(), width.abs() / 2.0)]
}

/// For each frame in a gap of a hand, the share of the gap's frames in which a duplicate of the other hand was
/// detected. `hand` is the mean score of the hand's points; 0: missing.
pub fn duplicate_share(hand: &[f32], other: impl Fn(usize) -> bool) -> Vec<f32> {
    let mut shares = Vec::with_capacity(hand.len());
    for run in hand.chunk_by(|a, b| (*a > 0.0) == (*b > 0.0)) {
        let start = shares.len();
        let n_other = (start..start + run.len()).filter(|&t| other(t)).count();
        shares.resize(start + run.len(), n_other as f32 / run.len() as f32);
    }
    shares
}

/// Distance between two necks, in shoulder widths.
fn neck_distance(before: Option<([f32; 2], f32)>, now: Option<([f32; 2], f32)>) -> f32 {
    let (Some((old, old_width)), Some((new, new_width))) = (before, now) else { return f32::NAN };
    (new[0] - old[0]).hypot(new[1] - old[1]) / new_width.max(old_width).max(1.0)
}

fn at(body: &ArrayView2<f32>, joint: usize) -> [f32; 2] {
    [body[[joint, 0]], body[[joint, 1]]]
}

fn mean_scores(hand: &ArrayView3<f32>) -> Vec<f32> {
    let n_points = hand.shape()[1].max(1) as f32;
    hand.outer_iter().map(|points| points.column(2).sum() / n_points).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    /// Shoulders `width` px apart (negative: left on the left), the nose 50 px above the neck, shifted by `aside` px.
    fn turned(width: f32, aside: f32) -> [f32; 2] {
        let mut body = Array2::from_elem((17, 3), 0.9_f32);
        for (joint, x, y) in [
            (coco::NOSE, 200.0 + aside, 50.0),
            (coco::L_SHOULDER, 200.0 + width / 2.0, 100.0),
            (coco::R_SHOULDER, 200.0 - width / 2.0, 100.0),
        ] {
            (body[[joint, 0]], body[[joint, 1]]) = (x, y);
        }
        facing_and_nose_off(&body.view(), [200.0, 100.0])
    }

    #[test]
    fn facing_distinguishes_front_side_and_back() {
        assert_eq!(turned(100.0, 0.0), [2.0, 0.0]);
        assert_eq!(turned(-100.0, 0.0), [-2.0, 0.0]);
        let [facing, nose_off] = turned(20.0, 30.0);
        assert!(facing < 0.4 && nose_off == 3.0);
        assert_eq!(turned(0.0, 10.0)[1], MAX_RATIO);
    }

    #[test]
    fn duplicate_share_is_constant_within_a_gap() {
        let hand = [0.9, 0.0, 0.0, 0.0, 0.0, 0.8, 0.0, 0.9];
        let shares = duplicate_share(&hand, |t| [1, 2, 4].contains(&t));
        assert_eq!(shares, [0.0, 0.75, 0.75, 0.75, 0.75, 0.0, 0.0, 0.0]);
        assert!(duplicate_share(&[], |_| true).is_empty());
    }

    #[test]
    fn identity_changes_count_except_at_restarts() {
        let restart = [true, false, false, false, true, false, false];
        let jump = [0.0, 0.0, 1.4, 0.0, 1.0, 0.01, f32::NAN];
        assert_eq!(identity(&[3, 3, 4, 4, 5, 6, 7], &restart, &jump), [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(identity(&[], &[], &[]), [0.0; 0]);
    }
}
