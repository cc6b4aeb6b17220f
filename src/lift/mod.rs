//! Stage 4: 2D keypoints to 3D joints. `body` lifts the arms, `hands` the hands; here they are joined at the wrists,
//! given the video's one set of bone lengths, and smoothed. The networks are `nn`'s, their weights `weights`'.
//!
//! What is known and what is not: a joint not seen for up to a second is filled and masked; one missing for longer is
//! NaN, with all that hangs on it. Size is a convention (`upper_body::REFERENCE_SIZE`), as no picture tells it.

mod body;
mod gaps;
mod hands;
mod stage;
pub mod weights;

pub use stage::LiftStage;

use crate::config;
use crate::motion::upper_body::{
    L_ELBOW, L_HIP, L_SHOULDER, L_WRIST, N_POINTS, NOSE, R_ELBOW, R_HIP, R_SHOULDER, R_WRIST,
};
use crate::motion::{bones, smooth, vec3};
use crate::nn::{body_lifter::BodyLifter, hand_lifter::HandLifter};
use crate::types::interval::Interval;
use crate::types::pose2d::{Keypoints, N_HAND};
use crate::types::pose3d::Motion;
use crate::types::skeleton::{self, L_HAND, N_BONES, N_JOINTS, NECK, R_HAND, Side};
use anyhow::{Result, ensure};
use body::{ArmLengths, Body, TRAINED_FPS};
use hands::Shapes;
use ndarray::{Array2, Array3, s};

/// A gap up to this long is filled; a longer one stays open. `config` lets `[segment]` keep no longer ones.
const MAX_GAP_SECS: f64 = 1.0;

/// Which of the nine points of the upper body each arm joint is.
const ARM_JOINTS: [(usize, usize); 6] = [
    (skeleton::R_SHOULDER, R_SHOULDER),
    (skeleton::R_ELBOW, R_ELBOW),
    (skeleton::R_WRIST, R_WRIST),
    (skeleton::L_SHOULDER, L_SHOULDER),
    (skeleton::L_ELBOW, L_ELBOW),
    (skeleton::L_WRIST, L_WRIST),
];

/// What is lifted beside the skeleton's joints.
const EXTRA: [usize; 3] = [NOSE, R_HIP, L_HIP];

/// Turns 2D keypoints into 3D motion.
pub struct Lifter {
    body: BodyLifter,
    hands: HandLifter,
    smooth_arms: f64,
    smooth_hands: f64,
}

/// A video lifted.
pub struct Lifted {
    /// NaN outside the intervals.
    pub motion: Motion,
    /// Nose, right hip, left hip, [T, 3, 3], in metres and axes of the joints; NaN where not seen for long.
    pub extra: Array3<f32>,
    /// The video's bone lengths in metres, of joints 1..=48; 0: never seen (and the hand roots).
    pub lengths: [f32; N_BONES],
    /// Frames that have arms.
    pub n_frames: usize,
}

/// One interval before it is given lengths.
struct Piece {
    interval: Interval,
    body: Body,
    left: Shapes,
    right: Shapes,
}

impl Lifter {
    /// Loads the networks that `settings` name, or the built-in ones. Errors name the file.
    pub fn new(settings: &config::Lift) -> Result<Self> {
        let (body, hands) = (weights::body(&settings.body_weights)?, weights::hands(&settings.hand_weights)?);
        Ok(Self::from_parts(body, hands, settings))
    }

    /// With networks that are there already; of `settings` only what follows the networks counts.
    pub fn from_parts(body: BodyLifter, hands: HandLifter, settings: &config::Lift) -> Self {
        Self { body, hands, smooth_arms: settings.smooth_arms, smooth_hands: settings.smooth_hands }
    }

    /// The motion of the whole video, taken as one continuous stretch.
    pub fn lift(&self, keypoints: &Keypoints) -> Result<Motion> {
        Ok(self.lift_intervals(keypoints, &[Interval { start: 0, end: keypoints.n_frames() }])?.motion)
    }

    /// The motion inside each interval, each lifted and smoothed by itself, all with the same bone lengths.
    /// Errors: an interval outside the video, keypoints of unequal lengths.
    pub fn lift_intervals(&self, keypoints: &Keypoints, intervals: &[Interval]) -> Result<Lifted> {
        let n_frames = keypoints.n_frames();
        for hand in [&keypoints.left_hand, &keypoints.right_hand] {
            ensure!(hand.shape()[0] == n_frames, "{n_frames} frames of body keypoints, {} of a hand", hand.shape()[0]);
        }
        let max_gap = (MAX_GAP_SECS * keypoints.fps.per_sec()).round() as usize;
        let lift = |&interval: &Interval| -> Result<Piece> {
            let Interval { start, end } = interval;
            ensure!(start <= end && end <= n_frames, "interval {start}..{end} of a video of {n_frames} frames");
            let hand = |points, side| hands::lift(&self.hands, points, side, interval, max_gap);
            Ok(Piece {
                interval,
                body: body::lift(&self.body, keypoints, interval, max_gap)?,
                left: hand(&keypoints.left_hand, Side::Left)?,
                right: hand(&keypoints.right_hand, Side::Right)?,
            })
        };
        let pieces: Vec<Piece> = intervals.iter().map(lift).collect::<Result<_>>()?;
        let arms = body::measure(pieces.iter().map(|p| &p.body));
        let shapes: Vec<&Shapes> = pieces.iter().flat_map(|p| [&p.left, &p.right]).collect();
        let hand = hands::measure(&shapes, arms.forearm);
        let lengths = all_lengths(&arms, hand.as_ref());
        let mut motion = Motion {
            fps: keypoints.fps,
            joints: Array3::from_elem((n_frames, N_JOINTS, 3), f32::NAN),
            mask: Array2::from_elem((n_frames, N_JOINTS), false),
        };
        let mut extra = Array3::from_elem((n_frames, EXTRA.len(), 3), f32::NAN);
        for piece in &pieces {
            let range = piece.interval.start..piece.interval.end;
            let (joints, beside, mask) = self.assemble(piece, &arms, &lengths, keypoints.fps.per_sec());
            extra.slice_mut(s![range.clone(), .., ..]).assign(&beside);
            motion.joints.slice_mut(s![range.clone(), .., ..]).assign(&joints);
            motion.mask.slice_mut(s![range, ..]).assign(&mask);
        }
        bones::with_lengths(&mut motion, &lengths);
        let n_frames = (0..n_frames).filter(|&t| motion.joints[[t, skeleton::R_SHOULDER, 0]].is_finite()).count();
        Ok(Lifted { motion, extra, lengths, n_frames })
    }

    /// Joints, extra points and mask of an interval: arms, hands hung on the wrists, smoothed. Lengths are exact but for smoothing.
    fn assemble(
        &self,
        piece: &Piece,
        arms: &ArmLengths,
        lengths: &[f32; N_BONES],
        fps: f64,
    ) -> (Array3<f32>, Array3<f32>, Array2<bool>) {
        let n_frames = piece.interval.n_frames();
        let frames = |sigma: f64| sigma * fps / TRAINED_FPS;
        let mut joints = Array3::from_elem((n_frames, N_JOINTS, 3), f32::NAN);
        let mut extra = Array3::from_elem((n_frames, EXTRA.len(), 3), f32::NAN);
        let mut mask = Array2::from_elem((n_frames, N_JOINTS), false);
        for t in 0..n_frames {
            let seen: &[bool; N_POINTS] = &piece.body.seen[t];
            let Some(pose) = &piece.body.poses[t] else { continue };
            let Some(size) = piece.body.size_at(t) else { continue };
            let pose = body::with_lengths(pose, size, arms);
            joints.slice_mut(s![t, NECK, ..]).fill(0.0);
            mask[[t, NECK]] = seen[R_SHOULDER] && seen[L_SHOULDER];
            for (joint, point) in ARM_JOINTS {
                (0..3).for_each(|k| joints[[t, joint, k]] = pose[point][k] as f32);
                mask[[t, joint]] = seen[point];
            }
            for (i, point) in EXTRA.into_iter().enumerate() {
                (0..3).for_each(|k| extra[[t, i, k]] = pose[point][k] as f32);
            }
        }
        smooth::gaussian(extra.view_mut(), frames(self.smooth_arms));
        smooth::gaussian(joints.slice_mut(s![.., ..L_HAND, ..]), frames(self.smooth_arms));
        for (root, wrist, shapes) in
            [(L_HAND, skeleton::L_WRIST, &piece.left), (R_HAND, skeleton::R_WRIST, &piece.right)]
        {
            let mut hand = hand_positions(shapes, root, lengths);
            smooth::gaussian(hand.view_mut(), frames(self.smooth_hands));
            let wrists = joints.slice(s![.., wrist..wrist + 1, ..]).to_owned();
            hand += &wrists;
            joints.slice_mut(s![.., root..root + N_HAND, ..]).assign(&hand);
            joints.slice_mut(s![.., root, ..]).assign(&wrists.slice(s![.., 0, ..]));
            for t in 0..n_frames {
                for j in 1..N_HAND {
                    mask[[t, root + j]] = shapes.seen[t][j] && joints[[t, root + j, 0]].is_finite();
                }
                mask[[t, root]] = mask[[t, wrist]];
            }
        }
        (joints, extra, mask)
    }
}

/// A hand from its wrist in metres, [T, 21, 3]; NaN where it is missing.
fn hand_positions(shapes: &Shapes, root: usize, lengths: &[f32; N_BONES]) -> Array3<f32> {
    let mut positions = Array3::from_elem((shapes.hands.len(), N_HAND, 3), f32::NAN);
    for (t, hand) in shapes.hands.iter().enumerate() {
        let Some(hand) = hand else { continue };
        let mut placed = [[0.0; 3]; N_HAND];
        for j in 1..N_HAND {
            let parent = crate::motion::hand_view::parent(j);
            let along = vec3::unit(vec3::sub(hand[j], hand[parent]), 1e-9).unwrap_or([0.0, 1.0, 0.0]);
            placed[j] = vec3::add(placed[parent], vec3::scale(along, f64::from(lengths[root + j - 1])));
        }
        for (j, p) in placed.iter().enumerate() {
            (0..3).for_each(|k| positions[[t, j, k]] = p[k] as f32);
        }
    }
    positions
}

/// The 48 bone lengths; hands that were never seen have none.
fn all_lengths(arms: &ArmLengths, hand: Option<&[f64; N_HAND]>) -> [f32; N_BONES] {
    std::array::from_fn(|bone| {
        let joint = bone + 1;
        let length = match joint {
            skeleton::R_SHOULDER | skeleton::L_SHOULDER => arms.shoulders / 2.0,
            skeleton::R_ELBOW | skeleton::L_ELBOW => arms.upper_arm,
            skeleton::R_WRIST | skeleton::L_WRIST => arms.forearm,
            _ => hand.map_or(0.0, |h| h[(joint - L_HAND) % N_HAND]),
        };
        length as f32
    })
}
