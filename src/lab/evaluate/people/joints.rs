//! Errors of lifted joints in camera axes, mm. Each frame is relative to its neck; in segments of 60 frames,
//! prediction and truth are each scaled by one factor to the reference size (`motion::upper_body`), since an image
//! does not show the size of a person; no rotation. Fingers are relative to their own wrist.

use super::clips::{RenderedClip, true_keypoints};
use anyhow::Result;
use ndarray::{Array2, ArrayView2, Axis};
use orator_base::math::procrustes;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{ARMS, L_ELBOW, L_WRIST, N_POINTS, Pose, R_ELBOW, R_WRIST, metres_per_unit};
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
    /// Fingers relative to their wrist.
    pub hand: f64,
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
                sums[0].add(&of_motion(&found), &truth);
                sums[1].add(&of_motion(&exact), &truth);
                sums[2].add(&vec![mean; truth.len()], &truth);
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

#[derive(Clone, Copy, Debug, Default)]
struct ErrorSums {
    body: JointErrors,
    fingers: f64,
    n_fingers: usize,
}

impl ErrorSums {
    /// Adds a segment, frames [49, 3] in metres.
    fn add(&mut self, predicted: &[Array2<f32>], truth: &[Array2<f32>]) {
        let [grow, true_grow] = [predicted, truth]
            .map(|frames| metres_per_unit(&frames.iter().map(|f| arms(f.view())).collect::<Vec<_>>()));
        for (p, q) in predicted.iter().zip(truth) {
            let place = |frame: &Array2<f32>, grow: f64, joint: usize, root: usize| -> Vec3 {
                std::array::from_fn(|k| grow * f64::from(frame[[joint, k]] - frame[[root, k]]))
            };
            let [from, to]: [Vec<Vec3>; 2] = [(p, grow), (q, true_grow)].map(|(frame, grow)| {
                std::iter::once(NECK).chain(ARMS).map(|joint| place(frame, grow, joint, NECK)).collect()
            });
            let distance = |joint: usize| vec3::norm(vec3::sub(from[joint], to[joint]));
            let depth = |joint: usize| (from[joint][2] - to[joint][2]).abs();
            let aligned = procrustes::similarity(&from, &to);
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
            self.body.n_frames += 1;
            for root in [L_HAND, R_HAND] {
                for joint in root + 1..root + N_HAND_JOINTS {
                    let off = vec3::norm(vec3::sub(place(p, grow, joint, root), place(q, true_grow, joint, root)));
                    if off.is_finite() {
                        self.fingers += off;
                        self.n_fingers += 1;
                    }
                }
            }
        }
    }

    fn mean(self) -> JointErrors {
        let Self { body, fingers, n_fingers } = self;
        let mean = |sum: f64, n: usize| if n == 0 { f64::NAN } else { MM * sum / n as f64 };
        let of_body = |sum: f64| mean(sum, body.n_frames);
        JointErrors {
            mpjpe: of_body(body.mpjpe),
            p_mpjpe: of_body(body.p_mpjpe),
            elbow: of_body(body.elbow),
            elbow_depth: of_body(body.elbow_depth),
            wrist: of_body(body.wrist),
            wrist_depth: of_body(body.wrist_depth),
            hand: mean(fingers, n_fingers),
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

    #[test]
    fn another_size_is_no_error_and_a_shift_of_a_wrist_is_its_length() {
        let clip = exact();
        let truth: Vec<Array2<f32>> = clip.truth.joints.outer_iter().map(|frame| frame.to_owned()).collect();
        let larger: Vec<Array2<f32>> = truth.iter().map(|frame| frame.mapv(|v| 1.4 * v)).collect();
        let mut sums = ErrorSums::default();
        sums.add(&larger, &truth);
        let same = sums.mean();
        assert!(same.mpjpe < 1e-3 && same.hand < 1e-3 && same.n_frames == 40, "{same:?}");
        let grow = metres_per_unit(&truth.iter().map(|f| arms(f.view())).collect::<Vec<_>>());
        // Across the line from elbow to wrist of all frames, so that the forearm hardly changes its length.
        let shifted: Vec<Array2<f32>> = truth
            .iter()
            .map(|frame| {
                let mut frame = frame.clone();
                frame[[L_WRIST, 0]] += 0.004;
                frame
            })
            .collect();
        let mut sums = ErrorSums::default();
        sums.add(&shifted, &truth);
        let moved = sums.mean();
        assert!((moved.wrist - 2.0 * grow).abs() < 0.6 && moved.elbow < 1.0, "{moved:?}");
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
