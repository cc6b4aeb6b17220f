//! Takes of captured motion for rendered persons, in the axes of the program's rigs (y up, x to the person's left, z
//! ahead). Only directions and rotations are used, so the unit of length is arbitrary.

use crate::mocap::neck::neck;
use crate::mocap::upper_body;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, any_across, cross, dot, sub, unit};
use orator_base::motion::upper_body::{ARMS, N_POINTS, Pose};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{
    L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, NECK, R_HAND, R_SHOULDER, R_WRIST, is_duplicate,
};
use orator_base::types::time::FrameRate;

/// Shortest excerpt, seconds: accepted intervals have at least 4.3 s.
const SHORTEST_SECS: f64 = 5.0;
/// Largest rotation about the vertical from the mean of an excerpt, degrees; beyond it, the back is visible.
const MAX_TURN_DEGREES: f64 = 100.0;
const UP: Vec3 = [0.0, 1.0, 0.0];

/// A person in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CapturedFrame {
    /// Joints of `types::skeleton` relative to any origin; NaN: the capture lacks the joint. The neck is the midpoint
    /// of the shoulders (`mocap::neck`).
    pub joints: [Vec3; N_JOINTS],
    /// Direction of the trunk towards the neck, a unit vector.
    pub spine: Vec3,
    /// Vector from the right to the left hip; `None`: the capture lacks the hips.
    pub hips: Option<Vec3>,
    /// World rotation of the head; the identity is level and faces ahead.
    pub head: Rotation,
}

/// A continuous take.
#[derive(Clone, Debug)]
pub struct CapturedTake {
    pub name: String,
    pub fps: FrameRate,
    pub frames: Vec<CapturedFrame>,
}

impl CapturedFrame {
    /// Frame without fingers. `arms`: shoulder, elbow and wrist of the right, then of the left arm; `below`: a point of
    /// the trunk below the neck.
    pub fn new(arms: [Vec3; 6], below: Vec3, hips: Option<Vec3>, head: Rotation) -> Self {
        let mut joints = [[f64::NAN; 3]; N_JOINTS];
        joints[R_SHOULDER..=L_WRIST].copy_from_slice(&arms);
        joints[NECK] = neck(joints[R_SHOULDER], joints[L_SHOULDER]);
        joints[L_HAND] = joints[L_WRIST];
        joints[R_HAND] = joints[R_WRIST];
        Self { joints, spine: unit(sub(joints[NECK], below), 1e-9).unwrap_or(UP), hips, head }
    }

    /// Vector from the right to the left shoulder.
    pub fn shoulder_line(&self) -> Vec3 {
        sub(self.joints[L_SHOULDER], self.joints[R_SHOULDER])
    }

    fn turned(&self, turn: Rotation) -> Self {
        Self {
            joints: self.joints.map(|at| turn.turn(at)),
            spine: turn.turn(self.spine),
            hips: self.hips.map(|line| turn.turn(line)),
            head: turn * self.head,
        }
    }

    /// Points by which jumps are found, relative to the neck.
    fn points(&self) -> Pose {
        let mut points: Pose = [[0.0; 3]; N_POINTS];
        ARMS.for_each(|joint| points[joint] = sub(self.joints[joint], self.joints[NECK]));
        points
    }
}

impl CapturedTake {
    /// Splits frames in metres at jumps, such as cuts; parts of less than a second are dropped.
    pub fn continuous(name: &str, fps: FrameRate, frames: &[CapturedFrame]) -> Vec<Self> {
        let points: Vec<Pose> = frames.iter().map(CapturedFrame::points).collect();
        let parts = upper_body::continuous(fps.per_sec(), &points).into_iter().enumerate();
        parts.map(|(k, part)| Self { name: format!("{name}#{k}"), fps, frames: frames[part].to_vec() }).collect()
    }

    /// Successive excerpts of 5 to `secs` seconds. Each is rotated about the vertical so that the person faces ahead on
    /// average; excerpts in which the person turns away from that direction are left out.
    pub fn excerpts(&self, secs: f64) -> Vec<Self> {
        let (n_frames, n_min) = (self.fps.frames_in(secs).max(1), self.fps.frames_in(secs.min(SHORTEST_SECS)));
        let long = self.frames.chunks(n_frames).enumerate().filter(|(_, frames)| frames.len() >= n_min);
        let excerpt = |(k, frames): (usize, &[CapturedFrame])| {
            let turn = facing(frames)?;
            let name = format!("{} {:.0} s", self.name, self.fps.secs(k * n_frames));
            let frames = frames.iter().map(|frame| frame.turned(turn)).collect();
            Some(Self { name, fps: self.fps, frames })
        };
        long.filter_map(excerpt).collect()
    }

    /// Joints that the capture lacks; rendered persons have generated ones.
    pub fn missing_joints(&self) -> Vec<usize> {
        let is_missing = |joint: usize| self.frames.first().is_none_or(|frame| frame.joints[joint][0].is_nan());
        (0..N_JOINTS).filter(|&joint| !is_duplicate(joint) && is_missing(joint)).collect()
    }

    /// Motion in the axes of `types::skeleton`, relative to the neck.
    pub fn motion(&self) -> Motion {
        let joints = ndarray::Array3::from_shape_fn((self.frames.len(), N_JOINTS, 3), |(t, joint, k)| {
            let from_neck = sub(self.frames[t].joints[joint], self.frames[t].joints[NECK]);
            (if k == 0 { from_neck[k] } else { -from_neck[k] }) as f32
        });
        Motion::from_joints(self.fps, joints)
    }
}

/// Rotation whose y axis is `up` and whose x axis is as close to `left` as possible.
pub fn oriented(left: Vec3, up: Vec3) -> Rotation {
    let up = unit(up, 1e-9).unwrap_or(UP);
    let left = unit(across(left, up), 1e-9).unwrap_or_else(|| any_across(up));
    Rotation::from_axes(left, up, cross(left, up))
}

/// Rotation about the vertical after which the mean shoulder line is along x; `None` if a frame is turned away from it.
fn facing(frames: &[CapturedFrame]) -> Option<Rotation> {
    let lines: Vec<Vec3> = frames.iter().filter_map(|frame| unit(across(frame.shoulder_line(), UP), 1e-9)).collect();
    let sum = lines.iter().fold([0.0; 3], |sum, line| [sum[0] + line[0], 0.0, sum[2] + line[2]]);
    let mean = unit(sum, 1e-9)?;
    let min_cos = MAX_TURN_DEGREES.to_radians().cos();
    let faces_ahead = lines.iter().all(|line| dot(*line, mean) >= min_cos);
    faces_ahead.then(|| Rotation::about(UP, mean[2].atan2(mean[0])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A person turned by `yaw` radians to the left, arms along the shoulder line.
    fn person(yaw: f64) -> CapturedFrame {
        let arm = |sign: f64| [0.2, 0.5, 0.7].map(|x| [sign * x, 1.4, 0.0]);
        let [right, left] = [arm(-1.0), arm(1.0)];
        let arms = [right[0], right[1], right[2], left[0], left[1], left[2]];
        CapturedFrame::new(arms, [0.0, 1.0, 0.0], Some([0.2, 0.0, 0.0]), Rotation::IDENTITY)
            .turned(Rotation::about(UP, yaw))
    }

    fn take(yaws: &[f64]) -> CapturedTake {
        let frames = yaws.iter().map(|&yaw| person(yaw)).collect();
        CapturedTake { name: "a".to_owned(), fps: FrameRate::new(2, 1), frames }
    }

    #[test]
    fn excerpts_face_ahead_and_turned_persons_are_left_out() {
        let mut yaws = vec![0.9; 16];
        yaws.extend([0.0; 12]);
        yaws.extend([0.0, 0.0, 0.0, 2.5]);
        yaws.extend([0.3; 9]);
        let excerpts = take(&yaws).excerpts(8.0);
        let names: Vec<&str> = excerpts.iter().map(|excerpt| excerpt.name.as_str()).collect();
        assert_eq!(names, ["a 0 s"], "16 frames are turned, and 9 are too few");
        let frame = &excerpts[0].frames[3];
        let [x, y, z] = frame.shoulder_line();
        assert!((x - 0.4).abs() < 1e-12 && y.abs() < 1e-12 && z.abs() < 1e-12, "{x} {y} {z}");
        assert!(frame.head.angle() < 1e-9 && (frame.hips.unwrap()[0] - 0.2).abs() < 1e-12);
    }

    #[test]
    fn missing_joints_are_the_fingers_and_the_motion_is_in_camera_axes() {
        let take = take(&[0.0; 4]);
        assert_eq!(take.missing_joints().len(), 40);
        let motion = take.motion();
        assert_eq!(motion.joints[[1, L_WRIST, 0]], 0.7);
        assert!(motion.joints[[0, L_HAND + 1, 0]].is_nan() && motion.joints[[0, NECK, 1]] == 0.0);
        assert!((take.frames[0].spine[1] - 1.0).abs() < 1e-12);
    }
}
