//! 3D lifting of the arms: observed upper-body points through the body lifter, to joints of roughly the reference size.

use super::gaps::long_gaps;
use super::hand_direction::hand_directions;
use super::lifter::IntervalView;
use super::observed::ObservedBody;
use anyhow::Result;
use ndarray::{Array2, s};
use orator_base::math::order::lower_median;
use orator_base::motion::upper_body::{
    ARMS, BodyPoints, HandDirections, L_HIP, L_SHOULDER, NOSE, Pose, R_HIP, R_SHOULDER, REFERENCE_SIZE, size,
};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::skeleton::NECK;
use orator_nn::lifter::body::BodyLifter;

/// Frame rate that the lifter was trained at.
pub const TRAINED_FPS: f64 = 15.0;
/// Half window, in frames at that rate, of the median of the apparent body size.
pub const SIZE_FRAMES: f64 = 15.0;
/// Half window, in frames at that rate, of the outlier detection.
pub const OUTLIER_FRAMES: f64 = 2.0;
/// Frames at that rate per batch, which bounds the memory for poses.
const BATCH_FRAMES: f64 = 4096.0;
/// Least context, in frames at that rate, on either side of a batch.
const CONTEXT_FRAMES: f64 = 128.0;

/// Reprojection error, in metres at the reference size, above which a keypoint counts as not visible because the
/// lifter placed the joint elsewhere. Noise and bias of detectors stay below 0.1.
const MAX_REPROJECTION_ERROR: f64 = 0.2;

/// The points that are lifted in addition to the joints.
const EXTRA: [usize; 3] = [NOSE, R_HIP, L_HIP];

/// Lifts arms, nose and hips over an interval into `into`, whose mask marks the visible joints. A point that is
/// missing for more than `max_gap` frames stays NaN; without a shoulder all points do.
///
/// # Errors
/// Those of the network.
pub fn lift(
    lifter: &BodyLifter,
    keypoints: &Keypoints,
    interval: Interval,
    max_gap: usize,
    into: &mut IntervalView,
) -> Result<()> {
    let step = keypoints.fps.per_sec() / TRAINED_FPS;
    let frames = |at_trained: f64| (at_trained * step).round() as usize;
    let mut observed = ObservedBody::from_keypoints(keypoints, interval, frames(OUTLIER_FRAMES).max(2), max_gap);
    let n_frames = interval.n_frames();
    let mut sizes = vec![f32::NAN; n_frames];
    let mut pass = |observed: &ObservedBody| -> Result<Array2<bool>> {
        let mut is_inlier = Array2::from_elem(observed.visible.dim(), true);
        // The context must cover the receptive field of the network.
        let margin = frames(CONTEXT_FRAMES.max(lifter.net.config().receptive_field() as f64)).max(1);
        for first in (0..n_frames).step_by(frames(BATCH_FRAMES).max(1)) {
            let end = n_frames.min(first + frames(BATCH_FRAMES).max(1));
            let from = first.saturating_sub(margin);
            let points: Vec<BodyPoints> = (from..n_frames.min(end + margin)).map(|t| observed.frame(t)).collect();
            let hands: Vec<HandDirections> =
                (from..n_frames.min(end + margin)).map(|t| hand_directions(keypoints, interval.start + t)).collect();
            let poses = lifter.poses(&points, &hands, step)?;
            for (t, pose) in poses.iter().enumerate().take(end - from).skip(first - from) {
                if let Some(pose) = pose {
                    sizes[from + t] = size(pose) as f32;
                    write_pose(pose, from + t, into);
                    outliers(pose, &points[t]).for_each(|joint| is_inlier[[from + t, joint]] = false);
                }
            }
        }
        Ok(is_inlier)
    };
    // Longer runs of outliers are left to the check of the bone lengths.
    let is_inlier = pass(&observed)?;
    if observed.reject(&is_inlier, max_gap) {
        pass(&observed)?;
    }
    to_reference(&sizes, frames(SIZE_FRAMES), into);
    for joint in ARMS {
        into.mask.slice_mut(s![.., joint]).assign(&observed.visible.slice(s![.., joint]));
    }
    for t in 0..n_frames {
        into.mask[[t, NECK]] = observed.visible[[t, R_SHOULDER]] && observed.visible[[t, L_SHOULDER]];
    }
    clear_long_gaps(&observed, max_gap, into);
    Ok(())
}

/// Arm joints whose reprojection is far from their keypoint.
fn outliers(pose: &Pose, visible: &BodyPoints) -> impl Iterator<Item = usize> {
    let most = MAX_REPROJECTION_ERROR * size(pose) / REFERENCE_SIZE;
    let is_far = move |joint: usize| {
        let (Some(right), Some(left), Some(point)) = (visible[R_SHOULDER], visible[L_SHOULDER], visible[joint]) else {
            return false;
        };
        let error = |k: usize| f64::from(point[k] - (right[k] + left[k]) / 2.0) - pose[joint][k];
        error(0).hypot(error(1)) > most
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

/// Scales from px to metres: the median body size over the frames within `half_window` becomes the reference size.
fn to_reference(sizes: &[f32], half_window: usize, into: &mut IntervalView) {
    for t in 0..sizes.len() {
        let around = sizes[t.saturating_sub(half_window)..sizes.len().min(t + half_window + 1)].to_vec();
        let scale = lower_median(around).map_or(f32::NAN, |size| REFERENCE_SIZE as f32 / size);
        into.joints.slice_mut(s![t, NECK.., ..]).mapv_inplace(|v| v * scale);
        into.extra.slice_mut(s![t, .., ..]).mapv_inplace(|v| v * scale);
    }
}

/// Sets points to NaN that are not visible for more than `max_gap` frames, and the body if such a point is a shoulder.
fn clear_long_gaps(observed: &ObservedBody, max_gap: usize, into: &mut IntervalView) {
    let frames = |point: usize| {
        let long = long_gaps(&observed.visible.column(point).to_vec(), max_gap);
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
