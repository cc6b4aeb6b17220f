//! Errors of lifted joints in camera axes, mm. Each frame is relative to the midpoint of its shoulders (`mocap::neck`);
//! in segments of 60 frames, prediction and truth are each scaled by one factor to the reference size
//! (`motion::upper_body`), since an image does not show the size of a person; no rotation. Fingers are relative to
//! their own wrist.

use super::clips::{RenderedClip, true_keypoints};
use crate::mocap::neck::neck;
use anyhow::Result;
use ndarray::{Array2, ArrayView2, Axis};
use orator_base::math::procrustes;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{
    ARMS, L_ELBOW, L_SHOULDER, L_WRIST, N_POINTS, Pose, R_ELBOW, R_SHOULDER, R_WRIST, metres_per_unit,
};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, N_JOINTS, NECK, R_HAND};
use orator_pipeline::lift::Lifter;
use serde::Serialize;

/// Number of frames scaled by one factor.
const SEGMENT: usize = 60;
/// Millimetres in a metre.
const MM: f64 = 1000.0;

/// Mean errors in mm over accepted frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct JointErrors {
    /// Shoulders, elbows, wrists.
    pub mpjpe: f64,
    /// Shoulders, elbows, wrists after a similarity alignment per frame.
    pub p_mpjpe: f64,
    pub elbow: f64,
    /// Along the line of sight: |dz|.
    pub elbow_depth: f64,
    pub wrist: f64,
    pub wrist_depth: f64,
    /// Displacement of the wrists from frame to frame.
    pub wrist_velocity: f64,
    /// Fingers relative to their wrist, except for generated ones of a capture.
    pub hand: f64,
    pub hand_depth: f64,
    /// MPJPE, elbows and wrists relative to the neck joint of each skeleton.
    pub of_neck: [f64; 3],
    /// Number of evaluated frames.
    pub n_frames: usize,
}

/// Errors of the pipeline's lifter on clips, of the same lifter with exact keypoints, and of each clip's mean pose, all
/// in the same frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LiftedErrors {
    pub lifted: JointErrors,
    pub of_true_keypoints: JointErrors,
    pub mean_pose: JointErrors,
}

/// Motions of clips as lifted from the detected keypoints (for the mask), and their errors. `lifter` must retain the
/// camera axes (`level = false`).
pub fn measure(lifter: &Lifter, clips: &[&RenderedClip]) -> Result<(Vec<Motion>, LiftedErrors)> {
    let mut sums = [ErrorSums::default(); 3];
    let mut motions = Vec::new();
    for clip in clips {
        let intervals = &clip.intervals.intervals;
        let found = lifter.lift_intervals(&clip.keypoints, intervals)?.motion;
        let exact = lifter.lift_intervals(&true_keypoints(clip), intervals)?.motion;
        for interval in intervals {
            for start in (interval.start..interval.end).step_by(SEGMENT) {
                let frames: Vec<usize> = (start..(start + SEGMENT).min(interval.end)).collect();
                let usable: Vec<usize> =
                    frames.into_iter().filter(|&t| is_lifted(&found, t) && is_lifted(&exact, t)).collect();
                if usable.is_empty() {
                    continue;
                }
                let of_motion = |motion: &Motion| {
                    usable.iter().map(|&t| motion.joints.index_axis(Axis(0), t).to_owned()).collect::<Vec<_>>()
                };
                let truth: Vec<Array2<f32>> =
                    usable.iter().map(|&t| clip.truth.joints.index_axis(Axis(0), t).to_owned()).collect();
                let mean = clip.truth.joints.mean_axis(Axis(0)).unwrap_or_else(|| Array2::zeros((N_JOINTS, 3)));
                let segment = TruthSegment { frames: &usable, truth: &truth, generated: &clip.generated_joints };
                sums[0].add(&of_motion(&found), &segment);
                sums[1].add(&of_motion(&exact), &segment);
                sums[2].add(&vec![mean; truth.len()], &segment);
            }
        }
        motions.push(found);
    }
    let [lifted, of_true_keypoints, mean_pose] = sums.map(ErrorSums::mean);
    Ok((motions, LiftedErrors { lifted, of_true_keypoints, mean_pose }))
}

/// Whether a frame has all points of the arms.
fn is_lifted(motion: &Motion, t: usize) -> bool {
    ARMS.into_iter().all(|joint| motion.joints[[t, joint, 0]].is_finite())
}

/// Ground truth of the evaluated frames of a segment.
struct TruthSegment<'a> {
    frames: &'a [usize],
    /// [49, 3] for each frame, metres.
    truth: &'a [Array2<f32>],
    generated: &'a [usize],
}

#[derive(Clone, Copy, Debug, Default)]
struct ErrorSums {
    body: JointErrors,
    n_steps: usize,
    n_fingers: usize,
}

impl ErrorSums {
    /// Adds a segment, frames [49, 3] in metres.
    fn add(&mut self, predicted: &[Array2<f32>], segment: &TruthSegment) {
        let TruthSegment { frames, truth, generated } = *segment;
        let [grow, true_grow] = [predicted, truth]
            .map(|frames| metres_per_unit(&frames.iter().map(|f| arms(f.view())).collect::<Vec<_>>()));
        let mut before: Option<(usize, [Vec3; 2])> = None;
        for ((p, q), &t) in predicted.iter().zip(truth).zip(frames) {
            let at = |frame: &Array2<f32>, grow: f64, joint: usize| -> Vec3 {
                std::array::from_fn(|k| grow * f64::from(frame[[joint, k]]))
            };
            // The neck joint and the arms about the midpoint of the shoulders.
            let [from, to]: [Vec<Vec3>; 2] = [(p, grow), (q, true_grow)].map(|(frame, grow)| {
                let middle = neck(at(frame, grow, R_SHOULDER), at(frame, grow, L_SHOULDER));
                std::iter::once(NECK).chain(ARMS).map(|joint| vec3::sub(at(frame, grow, joint), middle)).collect()
            });
            let off = |joint: usize| vec3::sub(from[joint], to[joint]);
            let distance = |joint: usize| vec3::norm(off(joint));
            let of_neck = |joint: usize| vec3::norm(vec3::sub(off(joint), off(NECK)));
            let depth = |joint: usize| off(joint)[2].abs();
            let [mut source, mut target] = [from.clone(), to.clone()];
            (source[NECK], target[NECK]) = ([0.0; 3], [0.0; 3]);
            let aligned = procrustes::similarity(&source, &target);
            let after =
                |joint: usize| vec3::norm(vec3::sub(aligned.map_or(from[joint], |s| s.apply(from[joint])), to[joint]));
            let both = |of: &dyn Fn(usize) -> f64, [a, b]: [usize; 2]| (of(a) + of(b)) / 2.0;
            let (elbows, wrists) = ([R_ELBOW, L_ELBOW], [R_WRIST, L_WRIST]);
            let n_arms = ARMS.count() as f64;
            self.body.mpjpe += ARMS.map(distance).sum::<f64>() / n_arms;
            self.body.p_mpjpe += ARMS.map(after).sum::<f64>() / n_arms;
            self.body.elbow += both(&distance, elbows);
            self.body.elbow_depth += both(&depth, elbows);
            self.body.wrist += both(&distance, wrists);
            self.body.wrist_depth += both(&depth, wrists);
            self.body.of_neck[0] += ARMS.map(of_neck).sum::<f64>() / n_arms;
            self.body.of_neck[1] += both(&of_neck, elbows);
            self.body.of_neck[2] += both(&of_neck, wrists);
            self.body.n_frames += 1;
            let now = wrists.map(off);
            if let Some((_, then)) = before.filter(|(frame, _)| frame + 1 == t) {
                let changes = now.iter().zip(then).map(|(now, then)| vec3::norm(vec3::sub(*now, then)));
                self.body.wrist_velocity += changes.sum::<f64>() / 2.0;
                self.n_steps += 1;
            }
            before = Some((t, now));
            for root in [L_HAND, R_HAND] {
                for joint in (root + 1..root + N_HAND_JOINTS).filter(|joint| !generated.contains(joint)) {
                    let finger =
                        |frame: &Array2<f32>, grow: f64| vec3::sub(at(frame, grow, joint), at(frame, grow, root));
                    let off = vec3::sub(finger(p, grow), finger(q, true_grow));
                    if off.iter().all(|v| v.is_finite()) {
                        self.body.hand += vec3::norm(off);
                        self.body.hand_depth += off[2].abs();
                        self.n_fingers += 1;
                    }
                }
            }
        }
    }

    fn mean(self) -> JointErrors {
        let Self { body, n_steps, n_fingers } = self;
        let mean = |sum: f64, n: usize| if n == 0 { f64::NAN } else { MM * sum / n as f64 };
        let of_body = |sum: f64| mean(sum, body.n_frames);
        JointErrors {
            mpjpe: of_body(body.mpjpe),
            p_mpjpe: of_body(body.p_mpjpe),
            elbow: of_body(body.elbow),
            elbow_depth: of_body(body.elbow_depth),
            wrist: of_body(body.wrist),
            wrist_depth: of_body(body.wrist_depth),
            wrist_velocity: mean(body.wrist_velocity, n_steps),
            hand: mean(body.hand, n_fingers),
            hand_depth: mean(body.hand_depth, n_fingers),
            of_neck: body.of_neck.map(of_body),
            n_frames: body.n_frames,
        }
    }
}

/// The arms of a frame [49, 3], which determine a body's size; other points are NaN.
fn arms(frame: ArrayView2<f32>) -> Pose {
    let mut pose: Pose = [[f64::NAN; 3]; N_POINTS];
    for joint in ARMS {
        pose[joint] = std::array::from_fn(|k| f64::from(frame[[joint, k]]));
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;
    use orator_dataset::config::LiftConfig;

    /// Errors of the exact clip's joints after a change, without joint `generated`.
    fn errors(change: impl Fn(usize, &mut Array2<f32>), generated: &[usize]) -> JointErrors {
        let truth: Vec<Array2<f32>> = exact().truth.joints.outer_iter().map(|frame| frame.to_owned()).collect();
        let frames: Vec<usize> = (0..truth.len()).collect();
        let mut predicted = truth.clone();
        predicted.iter_mut().enumerate().for_each(|(t, frame)| change(t, frame));
        let mut sums = ErrorSums::default();
        sums.add(&predicted, &TruthSegment { frames: &frames, truth: &truth, generated });
        sums.mean()
    }

    fn metres() -> f64 {
        metres_per_unit(&exact().truth.joints.outer_iter().map(arms).collect::<Vec<_>>())
    }

    #[test]
    fn another_size_is_no_error_and_a_shift_of_a_wrist_is_its_length() {
        let same = errors(|_, frame| frame.mapv_inplace(|v| 1.4 * v), &[]);
        assert!(same.mpjpe < 1e-3 && same.hand < 1e-3 && same.n_frames == 40, "{same:?}");
        assert!(same.wrist_velocity < 1e-3 && same.of_neck[0] < 1e-3, "{same:?}");
        // Across the line from elbow to wrist of all frames, so that the forearm hardly changes its length.
        let moved = errors(|_, frame| frame[[L_WRIST, 0]] += 0.004, &[]);
        assert!((moved.wrist - 2.0 * metres()).abs() < 0.6 && moved.elbow < 1.0, "{moved:?}");
        assert!(moved.wrist_velocity < 0.1, "{moved:?}");
        let shaken = errors(|t, frame| frame[[L_WRIST, 0]] += if t % 2 == 0 { 0.0 } else { 0.004 }, &[]);
        assert!((shaken.wrist_velocity - 2.0 * metres()).abs() < 0.6, "{shaken:?}");
    }

    #[test]
    fn the_neck_joint_changes_only_the_errors_about_the_neck() {
        let raised = errors(|_, frame| frame[[NECK, 1]] -= 0.05, &[]);
        assert!(raised.mpjpe < 1e-3 && raised.p_mpjpe < 1e-3 && raised.wrist < 1e-3, "{raised:?}");
        assert!(raised.of_neck.iter().all(|mm| (mm - 50.0 * metres()).abs() < 0.1), "{raised:?}");
    }

    #[test]
    fn generated_fingers_are_not_evaluated() {
        let bend = |_: usize, frame: &mut Array2<f32>| frame[[L_HAND + 8, 2]] += 0.1;
        let all = errors(bend, &[]);
        assert!((all.hand - 100.0 * metres() / 40.0).abs() < 0.1 && (all.hand - all.hand_depth).abs() < 0.1, "{all:?}");
        assert!(errors(bend, &[L_HAND + 8]).hand < 1e-3);
        let every: Vec<usize> = (L_HAND..N_JOINTS).collect();
        assert!(errors(bend, &every).hand.is_nan());
    }

    #[test]
    fn the_lifter_is_nearer_than_no_number_at_all() {
        let clip = exact();
        let lifter = Lifter::new(&LiftConfig { level: false, ..LiftConfig::default() }).unwrap();
        let (motions, errors) = measure(&lifter, &[&clip]).unwrap();
        assert_eq!((motions.len(), errors.lifted.n_frames), (1, 40));
        assert!((errors.lifted.mpjpe - errors.of_true_keypoints.mpjpe).abs() < 5.0, "{errors:?}");
        assert!(errors.lifted.wrist < 150.0 && errors.mean_pose.wrist < 60.0, "{errors:?}");
    }
}
