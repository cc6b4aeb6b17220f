//! `joints.npz`: the 3D motion of a video. Arrays: `pose3d` f32 [T,49,3] (metres, joint order and axes of
//! `types::skeleton`, NaN where there is no motion), `mask` bool [T,49], `fps` f64 [2] (numerator, denominator); for
//! a lifted video also `extra` f32 [T,3,3]: nose, right hip, left hip in the same axes, NaN if unknown.

use super::npz::{self, Npz};
use anyhow::{Context, Result};
use ndarray::{Array3, Ix2, Ix3};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use std::path::Path;

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
