//! `joints.npz`: the 3D motion of a video. Arrays: `pose3d` f32 [T,49,3] (metres, joint order and axes of
//! `types::skeleton`, NaN where there is no motion), `mask` bool [T,49], `fps` f64 [2] (numerator, denominator); for
//! a lifted video also `extra` f32 [T,3,3]: nose, right hip, left hip in the same axes, NaN if unknown.

use super::npz::{self, Npz};
use anyhow::{Context, Result};
use ndarray::{Array3, Ix2, Ix3};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use std::path::Path;

/// Reads the motion.
///
/// # Errors
///
/// The file is unreadable, or an array is missing, has a wrong shape or is out of range.
pub fn read(path: &Path) -> Result<Motion> {
    let mut npz = Npz::open(path)?;
    let joints = npz.floats("pose3d", &[None, Some(N_JOINTS), Some(3)])?.into_dimensionality::<Ix3>()?;
    let mask = npz.bools("mask", &[Some(joints.shape()[0]), Some(N_JOINTS)])?.into_dimensionality::<Ix2>()?;
    let motion = Motion { fps: npz.frame_rate("fps")?, joints, mask };
    motion.in_range().with_context(|| path.display().to_string())
}

/// Reads nose, right hip and left hip [T, 3, 3]; `None` if the file lacks them. Errors as [`read`].
pub fn read_extra(path: &Path) -> Result<Option<Array3<f32>>> {
    let mut npz = Npz::open(path)?;
    if !npz.has("extra") {
        return Ok(None);
    }
    Ok(Some(npz.floats("extra", &[None, Some(3), Some(3)])?.into_dimensionality::<Ix3>()?))
}

/// Writes the file at `path`. The bytes are deterministic.
pub fn write(path: &Path, motion: &Motion) -> Result<()> {
    write_with(path, motion, None)
}

/// Writes the file of a lifted video, including nose and hips.
pub fn write_lifted(path: &Path, motion: &Motion, extra: &Array3<f32>) -> Result<()> {
    write_with(path, motion, Some(extra))
}

fn write_with(path: &Path, motion: &Motion, extra: Option<&Array3<f32>>) -> Result<()> {
    npz::write(path, |npz| {
        npz.add_array("pose3d", &motion.joints)?;
        npz.add_array("mask", &motion.mask)?;
        npz.add_array("fps", &npz::rate(motion.fps))?;
        extra.map_or(Ok(()), |extra| npz.add_array("extra", extra))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3};
    use orator_base::types::time::FrameRate;

    #[test]
    fn nose_and_hips_are_stored_with_the_joints() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("joints.npz");
        let motion = Motion::from_joints(FrameRate::new(15, 1), Array3::zeros((2, N_JOINTS, 3)));
        write(&path, &motion).unwrap();
        assert_eq!(read_extra(&path).unwrap(), None);
        let extra = Array3::from_shape_fn((2, 3, 3), |(t, point, k)| (9 * t + 3 * point + k) as f32);
        write_lifted(&path, &motion, &extra).unwrap();
        assert_eq!((read(&path).unwrap(), read_extra(&path).unwrap()), (motion, Some(extra)));
    }

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(24))]
        #[test]
        fn motion_round_trips(
            n_frames in 0usize..4,
            (num, den) in (1u32..100_000, 1u32..1_002),
            numbers in proptest::collection::vec((proptest::num::f32::ANY, proptest::bool::ANY), 49 * 9),
            are_scaled in proptest::bool::ANY,
        ) {
            let at = |t: usize, j: usize, k: usize| {
                let (number, is_visible) = numbers[(t * 147 + j * 3 + k) % numbers.len()];
                (if are_scaled { number.sin() * 99.0 } else { number }, is_visible)
            };
            let motion = Motion {
                fps: FrameRate::new(num, den),
                joints: Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(t, j, k)| at(t, j, k).0),
                mask: Array2::from_shape_fn((n_frames, N_JOINTS), |(t, j)| at(t, j, 0).1),
            };
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("joints.npz");
            write(&path, &motion).unwrap();
            let is_far = motion.clone().in_range().is_err();
            let again = match read(&path) {
                Ok(again) => again,
                Err(error) => {
                    proptest::prop_assert!(is_far, "{error:#}");
                    return Ok(());
                }
            };
            proptest::prop_assert!(!is_far);
            proptest::prop_assert_eq!((again.fps, &again.mask), (motion.fps, &motion.mask));
            proptest::prop_assert!(again.joints.iter().zip(&motion.joints).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }
}
