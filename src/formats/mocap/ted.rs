//! TED Expressive: `human_joints` [T, 43, 3] in camera axes (y down), metres, of a regressor; `fps`; `sentence`.
//! Joint 1 is the neck, joint 0 the spine below it; left arm 2 4 6, right arm 3 5 7; three joints a finger and no tips.

use super::fingers::npz;
use super::take::CapturedMotion;
use crate::npz::Npz;
use anyhow::{Context, Result};
use ndarray::{Array3, s};
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, R_HAND, Side};
use serde_json::Map;
use std::path::Path;

/// Their joint for each of the house's 0..7: neck, right arm, left arm.
const BODY: [usize; 7] = [1, 3, 5, 7, 2, 4, 6];

/// Reads a clip. Joints that the source does not have (finger tips) are NaN.
pub fn read(path: &Path) -> Result<CapturedMotion> {
    let mut npz = Npz::open(path)?;
    let fps = npz.frame_rate("fps")?;
    let theirs = npz.numbers("human_joints", &[None, Some(43), Some(3)])?;
    let n_frames = theirs.shape()[0];
    let point = |t: usize, j: usize| -> Vec3 { std::array::from_fn(|k| theirs[[t, j, k]]) };
    let mut joints = Array3::from_elem((n_frames, N_JOINTS, 3), f32::NAN);
    let mut put = |t: usize, joint: usize, p: Vec3| {
        let from_neck = vec3::sub(p, point(t, BODY[0])).map(|v| v as f32);
        joints.slice_mut(s![t, joint, ..]).assign(&ndarray::aview1(&from_neck));
    };
    for t in 0..n_frames {
        BODY.iter().enumerate().for_each(|(joint, &j)| put(t, joint, point(t, j)));
    }
    for take in npz::read(path).with_context(|| path.display().to_string())? {
        let root = if take.side == Side::Left { L_HAND } else { R_HAND };
        for (t, fingers) in take.frames.iter().enumerate() {
            fingers.iter().enumerate().filter_map(|(k, p)| Some((k, (*p)?))).for_each(|(k, p)| put(t, root + k, p));
        }
    }
    Ok(CapturedMotion { motion: Motion::from_joints(fps, joints), text: npz.text("sentence"), facts: Map::new() })
}
