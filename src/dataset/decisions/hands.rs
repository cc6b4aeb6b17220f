//! Keypoints of a video as the stages after `pose2d` read them: with the hands exchanged where a user decided so.

use super::decision::Decision;
use anyhow::Result;
use ndarray::{Array3, Zip, s};
use orator_base::types::pose2d::{Keypoints, coco};
use orator_formats::keypoints_npz;
use std::ops::Range;
use std::path::Path;

/// Reads `keypoints.npz`, and exchanges the left and right hand in the ranges of `swaps`, decisions to swap hands.
///
/// # Errors
/// Those of `keypoints_npz::read`.
pub fn read_keypoints(path: &Path, swaps: &[&Decision]) -> Result<Keypoints> {
    let mut keypoints = keypoints_npz::read(path)?;
    for range in swapped(&keypoints, swaps) {
        swap_hands(&mut keypoints, range);
    }
    Ok(keypoints)
}

/// Runs of frames whose hands are exchanged: two exchanges of a frame cancel out.
pub fn swapped(keypoints: &Keypoints, swaps: &[&Decision]) -> Vec<Range<usize>> {
    let mut is_swapped = vec![false; keypoints.n_frames()];
    for swap in swaps {
        is_swapped[swap.frames(keypoints.fps, keypoints.n_frames())].iter_mut().for_each(|frame| *frame = !*frame);
    }
    let mut start = 0;
    let runs = is_swapped.chunk_by(|a, b| a == b).map(|run| {
        start += run.len();
        (run[0], start - run.len()..start)
    });
    runs.filter(|(is_swapped, _)| *is_swapped).map(|(_, range)| range).collect()
}

/// Exchanges the hands in `frames`. The hands may have been detected at the right arms but labelled as each other, or
/// the wrists were confused along with them: the wrists are exchanged if that brings them closer to the hands.
fn swap_hands(keypoints: &mut Keypoints, frames: Range<usize>) {
    let Keypoints { body, left_hand, right_hand, hand_depth, .. } = keypoints;
    let all = |frames: &Range<usize>| s![frames.clone(), .., ..];
    Zip::from(left_hand.slice_mut(all(&frames))).and(right_hand.slice_mut(all(&frames))).for_each(std::mem::swap);
    let row = |row: usize| s![frames.clone(), row, ..];
    if let Some(depth) = hand_depth {
        let (left, right) = depth.multi_slice_mut((row(0), row(1)));
        Zip::from(left).and(right).for_each(std::mem::swap);
    }
    // Sums over the range, so that the wrists do not jump within it.
    let distance = |wrist: usize, hand: &Array3<f32>| -> f32 {
        let visible = frames.clone().filter(|&t| hand[[t, 0, 2]] > 0.0);
        let along = |t: usize, k: usize| body[[t, wrist, k]] - hand[[t, 0, k]];
        visible.map(|t| along(t, 0).hypot(along(t, 1))).sum()
    };
    let own = distance(coco::L_WRIST, left_hand) + distance(coco::R_WRIST, right_hand);
    let other = distance(coco::R_WRIST, left_hand) + distance(coco::L_WRIST, right_hand);
    if other < own {
        let (left, right) = body.multi_slice_mut((row(coco::L_WRIST), row(coco::R_WRIST)));
        Zip::from(left).and(right).for_each(std::mem::swap);
    }
}
