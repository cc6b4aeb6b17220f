//! Arms in 3D: what is seen of the upper body, through the body lifter, to joints of about the reference size.

use super::gaps::long_gaps;
use super::lifter::IntervalView;
use super::observed::ObservedBody;
use anyhow::Result;
use ndarray::{Array2, s};
use orator_base::math::order::lower_median;
use orator_base::motion::upper_body::{
    ARMS, L_HIP, L_SHOULDER, NOSE, Pose, R_HIP, R_SHOULDER, REFERENCE_SIZE, SeenBody, size,
};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::skeleton::NECK;
use orator_nn::lifter::body::BodyLifter;

/// Frames a second that the lifter was trained on.
pub const TRAINED_FPS: f64 = 15.0;
/// Frames at that rate, before and after, that a body's apparent size is taken over.
pub const SIZE_FRAMES: f64 = 15.0;
/// Frames at that rate, before and after, that a stray point is told by.
pub const STRAY_FRAMES: f64 = 2.0;
/// Frames at that rate that are lifted in one go, so that no more poses are held at a time.
const GO: f64 = 4096.0;
/// Frames at that rate, before and after, that the lifter may look at beyond its window.
const MARGIN: f64 = 128.0;

/// Distance of a lifted point from its keypoint, in the picture and in metres at the reference size, from which the
/// keypoint counts as not seen: the lifter has put the joint elsewhere. Noise and bias of detectors stay below 0.1.
const DISBELIEVED: f64 = 0.2;

/// Which of the nine points are lifted beside the joints.
const EXTRA: [usize; 3] = [NOSE, R_HIP, L_HIP];

/// Lifts arms, nose and hips over an interval into `into`, whose mask says which joints were seen. A point missing for
/// more than `max_gap` frames stays NaN; without a shoulder all do.
pub fn lift(
    lifter: &BodyLifter,
    keypoints: &Keypoints,
    interval: Interval,
    max_gap: usize,
    into: &mut IntervalView,
) -> Result<()> {
    let step = keypoints.fps.per_sec() / TRAINED_FPS;
    let frames = |at_trained: f64| (at_trained * step).round() as usize;
    let mut sight = ObservedBody::from_keypoints(keypoints, interval, frames(STRAY_FRAMES).max(2), max_gap);
    let n_frames = interval.n_frames();
    let mut sizes = vec![f32::NAN; n_frames];
    let mut pass = |sight: &ObservedBody| -> Result<Array2<bool>> {
        let mut believed = Array2::from_elem(sight.seen.dim(), true);
        // a frame is placed by frames that lie within this many
        let margin = frames(MARGIN.max(lifter.net.config().receptive_field() as f64)).max(1);
        for first in (0..n_frames).step_by(frames(GO).max(1)) {
            let end = n_frames.min(first + frames(GO).max(1));
            let from = first.saturating_sub(margin);
            let points: Vec<SeenBody> = (from..n_frames.min(end + margin)).map(|t| sight.frame(t)).collect();
            let poses = lifter.poses(&points, step)?;
            for (t, pose) in poses.iter().enumerate().take(end - from).skip(first - from) {
                if let Some(pose) = pose {
                    sizes[from + t] = size(pose) as f32;
                    write_pose(pose, from + t, into);
                    disbelieved(pose, &points[t]).for_each(|joint| believed[[from + t, joint]] = false);
                }
            }
        }
        Ok(believed)
    };
    // What is disbelieved for longer is told by the lengths of the bones.
    let believed = pass(&sight)?;
    if sight.forget(&believed, max_gap) {
        pass(&sight)?;
    }
    to_reference(&sizes, frames(SIZE_FRAMES), into);
    for joint in ARMS {
        into.mask.slice_mut(s![.., joint]).assign(&sight.seen.slice(s![.., joint]));
    }
    for t in 0..n_frames {
        into.mask[[t, NECK]] = sight.seen[[t, R_SHOULDER]] && sight.seen[[t, L_SHOULDER]];
    }
    forget_long_gaps(&sight, max_gap, into);
    Ok(())
}

/// Joints of the arms that were lifted to another place in the picture than their keypoint's.
fn disbelieved(pose: &Pose, seen: &SeenBody) -> impl Iterator<Item = usize> {
    let most = DISBELIEVED * size(pose) / REFERENCE_SIZE;
    let is_far = move |joint: usize| {
        let (Some(right), Some(left), Some(point)) = (seen[R_SHOULDER], seen[L_SHOULDER], seen[joint]) else {
            return false;
        };
        let off = |k: usize| f64::from(point[k] - (right[k] + left[k]) / 2.0) - pose[joint][k];
        off(0).hypot(off(1)) > most
    };
    ARMS.filter(move |joint| is_far(*joint))
}

fn write_pose(pose: &Pose, t: usize, into: &mut IntervalView) {
    into.joints.slice_mut(s![t, NECK, ..]).fill(0.0);
    for joint in ARMS {
        (0..3).for_each(|k| into.joints[[t, joint, k]] = pose[joint][k] as f32);
    }
    for (i, point) in EXTRA.into_iter().enumerate() {
        (0..3).for_each(|k| into.extra[[t, i, k]] = pose[point][k] as f32);
    }
}

/// From px to metres: the body's median size over the frames within `reach` becomes the reference size.
fn to_reference(sizes: &[f32], reach: usize, into: &mut IntervalView) {
    for t in 0..sizes.len() {
        let around = sizes[t.saturating_sub(reach)..sizes.len().min(t + reach + 1)].to_vec();
        let grow = lower_median(around).map_or(f32::NAN, |size| REFERENCE_SIZE as f32 / size);
        into.joints.slice_mut(s![t, NECK.., ..]).mapv_inplace(|v| v * grow);
        into.extra.slice_mut(s![t, .., ..]).mapv_inplace(|v| v * grow);
    }
}

/// Makes missing what was not seen for more than `max_gap` frames, with the whole body where that is a shoulder.
fn forget_long_gaps(sight: &ObservedBody, max_gap: usize, into: &mut IntervalView) {
    let frames = |point: usize| {
        let long = long_gaps(&sight.seen.column(point).to_vec(), max_gap);
        (0..long.len()).filter(move |&t| long[t])
    };
    for joint in ARMS {
        frames(joint).for_each(|t| into.joints.slice_mut(s![t, joint, ..]).fill(f32::NAN));
    }
    for (i, point) in EXTRA.into_iter().enumerate() {
        frames(point).for_each(|t| into.extra.slice_mut(s![t, i, ..]).fill(f32::NAN));
    }
    for t in frames(R_SHOULDER).chain(frames(L_SHOULDER)) {
        into.joints.slice_mut(s![t, .., ..]).fill(f32::NAN);
        into.extra.slice_mut(s![t, .., ..]).fill(f32::NAN);
    }
}
