//! The joints file `joints.npz`: the 3D motion of a video. Arrays: `pose3d` f32 [T,49,3] (metres, house order, NaN
//! where there is no motion), `mask` bool [T,49], `fps` f64 [2] (numerator, denominator).

use super::npz;
use super::npz::Npz;
use crate::types::pose3d::Motion;
use crate::types::skeleton::N_JOINTS;
use anyhow::{Context, Result};
use ndarray::{Ix2, Ix3};
use std::path::Path;

/// Reads the motion. Errors: unreadable, an array missing or of a wrong shape.
pub fn read(path: &Path) -> Result<Motion> {
    let mut npz = Npz::open(path)?;
    let joints = npz.floats("pose3d", &[None, Some(N_JOINTS), Some(3)])?.into_dimensionality::<Ix3>()?;
    let mask = npz.bools("mask", &[Some(joints.shape()[0]), Some(N_JOINTS)])?.into_dimensionality::<Ix2>()?;
    let motion = Motion { fps: npz.frame_rate("fps")?, joints, mask };
    motion.in_range().with_context(|| path.display().to_string())
}

/// Writes the file at `path`; the same motion gives the same bytes.
pub fn write(path: &Path, motion: &Motion) -> Result<()> {
    npz::write(path, |npz| {
        npz.add_array("pose3d", &motion.joints)?;
        npz.add_array("mask", &motion.mask)?;
        npz.add_array("fps", &npz::rate(motion.fps))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::time::FrameRate;
    use ndarray::{Array2, Array3};

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(24))]
        #[test]
        fn any_motion_comes_back(
            n_frames in 0usize..4,
            (num, den) in (1u32..100_000, 1u32..1_002),
            numbers in proptest::collection::vec((proptest::num::f32::ANY, proptest::bool::ANY), 49 * 9),
            are_scaled in proptest::bool::ANY,
        ) {
            let at = |t: usize, j: usize, k: usize| {
                let (number, seen) = numbers[(t * 147 + j * 3 + k) % numbers.len()];
                (if are_scaled { number.sin() * 99.0 } else { number }, seen)
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
