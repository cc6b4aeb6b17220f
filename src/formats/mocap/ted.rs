//! TED Expressive: `human_joints` [T, 43, 3] in camera axes (y down), metres, estimated by a regressor; `fps`;
//! `sentence`. Joint 1 is the neck, 0 the spine below it; left arm 2 4 6, right arm 3 5 7; three per finger, no tips.

use super::captured::CapturedMotion;
use crate::npz::Npz;
use anyhow::Result;
use ndarray::{Array3, s};
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::pose2d::N_HAND;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, R_HAND, Side};
use serde_json::Map;
use std::path::Path;

/// Number of joints per frame.
pub const N_TED: usize = 43;
/// TED joint for each of joints 0..7 of `types::skeleton`: neck, right arm, left arm.
const BODY: [usize; 7] = [1, 3, 5, 7, 2, 4, 6];
/// Base joints of the fingers in file order: index, middle, little, ring, thumb.
const ROOTS: [usize; 5] = [5, 9, 17, 13, 1];

/// TED joint for each point of a hand: wrist, then thumb to little finger, each base to tip.
pub fn hand(side: Side) -> [Option<usize>; N_HAND] {
    let (wrist, first) = if side == Side::Left { (6, 8) } else { (7, 23) };
    let mut joints = [None; N_HAND];
    joints[0] = Some(wrist);
    for (finger, root) in ROOTS.into_iter().enumerate() {
        (0..3).for_each(|k| joints[root + k] = Some(first + 3 * finger + k));
    }
    joints
}

/// Reads a clip. Joints that the source lacks (finger tips) are NaN.
pub fn read(path: &Path) -> Result<CapturedMotion> {
    let mut npz = Npz::open(path)?;
    let fps = npz.frame_rate("fps")?;
    let ted_joints = npz.numbers("human_joints", &[None, Some(N_TED), Some(3)])?;
    let point = |t: usize, j: usize| -> Vec3 { std::array::from_fn(|k| ted_joints[[t, j, k]]) };
    let hand_joints = |side, root| hand(side).into_iter().enumerate().filter_map(move |(k, j)| Some((root + k, j?)));
    let body =
        BODY.into_iter().enumerate().chain(hand_joints(Side::Left, L_HAND)).chain(hand_joints(Side::Right, R_HAND));
    let mut joints = Array3::from_elem((ted_joints.shape()[0], N_JOINTS, 3), f32::NAN);
    for (joint, j) in body {
        for t in 0..ted_joints.shape()[0] {
            let from_neck = vec3::sub(point(t, j), point(t, BODY[0])).map(|v| v as f32);
            joints.slice_mut(s![t, joint, ..]).assign(&ndarray::aview1(&from_neck));
        }
    }
    Ok(CapturedMotion { motion: Motion::from_joints(fps, joints), text: npz.text("sentence"), facts: Map::new() })
}
