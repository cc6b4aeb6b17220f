//! Per-frame ground truth of a rendered video of a person, as one `.npz` file.

use anyhow::{Result, ensure};
use ndarray::{Array1, Array2, Array3, Dimension, Ix1, Ix2, Ix3, aview1};
use orator_base::stage::workdir;
use orator_base::types::pose2d::{N_BODY, N_HAND};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use orator_formats::npz;
use orator_formats::npz::Npz;
use std::path::Path;

/// Visibility of a point, and what occludes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Visibility {
    Visible,
    /// Behind another part of the same body; for a finger also behind its own hand.
    BehindBody,
    /// Behind a hand that it does not belong to: a finger behind the other hand, a shoulder behind either.
    BehindHand,
    /// Behind an object: a desk or a held object.
    BehindObject,
    /// Behind another person.
    BehindPerson,
    /// Outside the image.
    Outside,
}

impl Visibility {
    /// All values, in the order of their codes in a file.
    pub const ALL: [Self; 6] =
        [Self::Visible, Self::BehindBody, Self::BehindHand, Self::BehindObject, Self::BehindPerson, Self::Outside];
}

/// File that lists the clips in a folder of rendered persons.
pub const LIST: &str = "people.json";

/// Array name by which this file is distinguished from other motion files.
pub const BODY_JOINTS: &str = "body_joints";

/// Ground truth of the main person at every frame of the video.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderedTruth {
    pub fps: FrameRate,
    /// COCO-17, [T, 17, 2] px.
    pub body: Array3<f32>,
    pub body_visibility: Array2<Visibility>,
    /// Left hand, [T, 21, 2] px.
    pub left_hand: Array3<f32>,
    pub left_hand_visibility: Array2<Visibility>,
    /// Right hand, [T, 21, 2] px.
    pub right_hand: Array3<f32>,
    pub right_hand_visibility: Array2<Visibility>,
    /// Joints [T, 49, 3] in camera axes (x right, y down, z away), metres, the neck at the origin of every frame.
    pub joints: Array3<f32>,
    /// COCO-17 in the same axes and from the same origin, [T, 17, 3], metres; face points lie on the skin.
    pub body_joints: Array3<f32>,
    /// Neck [T, 3] in camera axes, metres.
    pub neck: Array2<f32>,
    /// Focal length, px.
    pub focal_px: f32,
    /// Upward unit vector of the world, in camera axes.
    pub up: [f32; 3],
    /// Rotation of the head in camera axes [T, 3], degrees: yaw (positive: to the person's left), pitch (positive: up),
    /// roll (positive: towards the person's left shoulder); all 0 facing the camera.
    pub head: Array2<f32>,
    /// Mouth opening [T], 0 closed .. 1 fully open.
    pub mouth: Array1<f32>,
    /// Whether the sound comes from this person's mouth [T].
    pub speaks: Array1<bool>,
}

impl RenderedTruth {
    /// Number of frames of the video.
    pub fn n_frames(&self) -> usize {
        self.joints.shape()[0]
    }

    /// Writes every field under its name; visibility as its code, `fps` as [num, den].
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let fps = [self.fps.num, self.fps.den].map(i64::from);
        let codes = |seen: &Array2<Visibility>| seen.mapv(|seen| i32::from(seen as u8));
        workdir::replace(path, |attempt| {
            npz::write(attempt, |npz| {
                npz.add_array("fps", &aview1(&fps))?;
                npz.add_array("body", &self.body)?;
                npz.add_array("body_seen", &codes(&self.body_visibility))?;
                npz.add_array("left_hand", &self.left_hand)?;
                npz.add_array("left_hand_seen", &codes(&self.left_hand_visibility))?;
                npz.add_array("right_hand", &self.right_hand)?;
                npz.add_array("right_hand_seen", &codes(&self.right_hand_visibility))?;
                npz.add_array("joints", &self.joints)?;
                npz.add_array(BODY_JOINTS, &self.body_joints)?;
                npz.add_array("neck", &self.neck)?;
                npz.add_array("focal_px", &aview1(&[self.focal_px]))?;
                npz.add_array("up", &aview1(&self.up))?;
                npz.add_array("head", &self.head)?;
                npz.add_array("mouth", &self.mouth)?;
                npz.add_array("speaks", &self.speaks)
            })
        })
    }

    /// Reads a file written by `write`.
    ///
    /// # Errors
    /// An array that is missing or has another shape or number of frames; an unknown visibility code.
    pub fn read(path: &Path) -> Result<Self> {
        let mut npz = Npz::open(path)?;
        let fps = npz.frame_rate("fps")?;
        let joints = floats::<Ix3>(&mut npz, "joints", &[None, Some(N_JOINTS), Some(3)])?;
        let n = Some(joints.shape()[0]);
        let mut seen = |name: &str, points: usize| -> Result<Array2<Visibility>> {
            let codes = npz.numbers(name, &[n, Some(points)])?.into_dimensionality::<Ix2>()?;
            let known = |&code: &f64| (0.0..Visibility::ALL.len() as f64).contains(&code) && code.fract() == 0.0;
            ensure!(
                codes.iter().all(known),
                "invalid visibility code in the array `{name}` of {}: expected 0 to {}",
                path.display(),
                Visibility::ALL.len() - 1
            );
            Ok(codes.mapv(|code| Visibility::ALL[code as usize]))
        };
        let body_visibility = seen("body_seen", N_BODY)?;
        let left_hand_visibility = seen("left_hand_seen", N_HAND)?;
        let right_hand_visibility = seen("right_hand_seen", N_HAND)?;
        let speaks = npz.bools("speaks", &[n])?.into_dimensionality::<Ix1>()?;
        Ok(Self {
            fps,
            body: floats(&mut npz, "body", &[n, Some(N_BODY), Some(2)])?,
            body_visibility,
            left_hand: floats(&mut npz, "left_hand", &[n, Some(N_HAND), Some(2)])?,
            left_hand_visibility,
            right_hand: floats(&mut npz, "right_hand", &[n, Some(N_HAND), Some(2)])?,
            right_hand_visibility,
            joints,
            body_joints: floats(&mut npz, BODY_JOINTS, &[n, Some(N_BODY), Some(3)])?,
            neck: floats(&mut npz, "neck", &[n, Some(3)])?,
            focal_px: floats::<Ix1>(&mut npz, "focal_px", &[Some(1)])?[0],
            up: {
                let up = floats::<Ix1>(&mut npz, "up", &[Some(3)])?;
                [up[0], up[1], up[2]]
            },
            head: floats(&mut npz, "head", &[n, Some(3)])?,
            mouth: floats(&mut npz, "mouth", &[n])?,
            speaks,
        })
    }
}

fn floats<D: Dimension>(npz: &mut Npz, name: &str, shape: &[Option<usize>]) -> Result<ndarray::Array<f32, D>> {
    Ok(npz.floats(name, shape)?.into_dimensionality::<D>()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reads_back() {
        let n = 4;
        let mut body_visibility = Array2::from_elem((n, N_BODY), Visibility::Visible);
        body_visibility[[2, 9]] = Visibility::BehindObject;
        let truth = RenderedTruth {
            fps: FrameRate::new(15, 1),
            body: Array3::from_elem((n, N_BODY, 2), 3.5),
            body_visibility,
            left_hand: Array3::zeros((n, N_HAND, 2)),
            left_hand_visibility: Array2::from_elem((n, N_HAND), Visibility::Outside),
            right_hand: Array3::zeros((n, N_HAND, 2)),
            right_hand_visibility: Array2::from_elem((n, N_HAND), Visibility::BehindHand),
            joints: Array3::from_elem((n, N_JOINTS, 3), 0.25),
            body_joints: Array3::from_elem((n, N_BODY, 3), -0.5),
            neck: Array2::from_elem((n, 3), 1.5),
            focal_px: 900.0,
            up: [0.0, -1.0, 0.0],
            head: Array2::zeros((n, 3)),
            mouth: Array1::from_elem(n, 0.5),
            speaks: Array1::from_elem(n, true),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        truth.write(&path).unwrap();
        assert_eq!(RenderedTruth::read(&path).unwrap(), truth);
    }
}
