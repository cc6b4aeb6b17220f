//! Ground truth of a clip: every joint in 3D and in px, at the dataset's frame rate, in one `.npz` file per video.

use super::paint;
use super::scene::DrawnScene;
use ndarray::{Array3, Ix3, aview1, s};
use orator_base::math::vec3::{Vec3, sub};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, N_JOINTS, NECK, R_HAND};
use orator_base::types::time::FrameRate;
use orator_formats::npz;
use orator_formats::npz::Npz;
use std::path::Path;

/// Ground truth of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnTruth {
    /// Joints in camera axes relative to the neck, metres.
    pub motion: Motion,
    /// COCO points 0..13, [T, 13, 2] px.
    pub body: Array3<f32>,
    /// Left hand, [T, 21, 2] px.
    pub left_hand: Array3<f32>,
    /// Right hand, [T, 21, 2] px.
    pub right_hand: Array3<f32>,
}

impl DrawnTruth {
    /// Ground truth of a scene at the frames of `fps`.
    pub fn new(scene: &DrawnScene, fps: FrameRate) -> Self {
        let n_frames = fps.frames_in(scene.secs);
        let mut joints = Array3::zeros((n_frames, N_JOINTS, 3));
        let mut pixels = Array3::zeros((n_frames, N_JOINTS, 2));
        let mut body = Array3::zeros((n_frames, 13, 2));
        let camera = &scene.camera;
        for frame_idx in 0..n_frames {
            let figure = scene.figure(fps.secs(frame_idx));
            let in_camera: Vec<Vec3> = figure.joints.iter().map(|&joint| camera.to_camera(joint)).collect();
            for (joint, &point) in in_camera.iter().enumerate() {
                let rooted = sub(point, in_camera[NECK]);
                (0..3).for_each(|k| joints[[frame_idx, joint, k]] = rooted[k] as f32);
                let px = camera.pixel(point);
                (0..2).for_each(|k| pixels[[frame_idx, joint, k]] = px[k] as f32);
            }
            for (point, position) in paint::coco(&figure).into_iter().enumerate() {
                let px = camera.pixel(camera.to_camera(position));
                (0..2).for_each(|k| body[[frame_idx, point, k]] = px[k] as f32);
            }
        }
        let hand = |root: usize| pixels.slice(s![.., root..root + N_HAND_JOINTS, ..]).to_owned();
        Self { left_hand: hand(L_HAND), right_hand: hand(R_HAND), motion: Motion::from_joints(fps, joints), body }
    }

    /// Writes `joints`, `body`, `left_hand`, `right_hand` and `fps` [num, den].
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        let fps = [self.motion.fps.num, self.motion.fps.den].map(i64::from);
        orator_base::stage::workdir::replace(path, |attempt| {
            npz::write(attempt, |npz| {
                npz.add_array("joints", &self.motion.joints)?;
                npz.add_array("body", &self.body)?;
                npz.add_array("left_hand", &self.left_hand)?;
                npz.add_array("right_hand", &self.right_hand)?;
                npz.add_array("fps", &aview1(&fps))
            })
        })
    }

    /// Reads a file written by `write`.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let mut npz = Npz::open(path)?;
        let fps = npz.frame_rate("fps")?;
        let mut get = |name: &str, points: usize, axes: usize| -> anyhow::Result<Array3<f32>> {
            Ok(npz.floats(name, &[None, Some(points), Some(axes)])?.into_dimensionality::<Ix3>()?)
        };
        Ok(Self {
            motion: Motion::from_joints(fps, get("joints", N_JOINTS, 3)?),
            body: get("body", 13, 2)?,
            left_hand: get("left_hand", N_HAND_JOINTS, 2)?,
            right_hand: get("right_hand", N_HAND_JOINTS, 2)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_round_trip_and_the_neck_is_between_the_shoulders() {
        let truth = DrawnTruth::new(&DrawnScene::new(3, 1.0, [640, 480]), FrameRate::new(15, 1));
        assert_eq!(truth.motion.n_frames(), 15);
        let joints = &truth.motion.joints;
        assert!((0..3).all(|k| (joints[[7, 1, k]] + joints[[7, 4, k]]).abs() < 1e-5));
        assert!(truth.body.iter().zip([640.0f32, 480.0].iter().cycle()).all(|(&v, &end)| v > 0.0 && v < end));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        truth.write(&path).unwrap();
        assert_eq!(DrawnTruth::read(&path).unwrap(), truth);
    }
}
