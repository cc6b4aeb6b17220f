//! Motion as a plain `.npy` array [T, 49, 3] of f32 in house order, a missing joint NaN. The rate is not in the file.

use crate::types::{pose3d::Motion, skeleton::N_JOINTS, time::FrameRate};
use anyhow::{Context as _, ensure};
use ndarray::Array3;
use ndarray_npy::{ReadNpyExt as _, WriteNpyExt as _};
use std::fs::File;
use std::io::{BufReader, BufWriter, Write as _};
use std::path::Path;

/// Reads a motion of `fps`; joints that are not finite are missing, in the mask too.
pub fn read(path: &Path, fps: FrameRate) -> anyhow::Result<Motion> {
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let joints = Array3::<f32>::read_npy(BufReader::new(file))
        .with_context(|| format!("{} is not a .npy file of float32 with three axes", path.display()))?;
    ensure!(
        joints.shape()[1..] == [N_JOINTS, 3],
        "{} has the shape {:?}, expected [frames, {N_JOINTS}, 3]",
        path.display(),
        joints.shape()
    );
    Ok(Motion::from_joints(fps, joints))
}

/// Writes the joints. Call it inside `stage::workdir::replace`: it writes in place.
pub fn write(path: &Path, motion: &Motion) -> anyhow::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    motion.joints.as_standard_layout().write_npy(&mut file)?;
    Ok(file.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back_and_a_wrong_shape_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.npy");
        let mut joints = Array3::from_shape_fn((4, N_JOINTS, 3), |(t, j, k)| (t * 1000 + j * 3 + k) as f32);
        joints[[2, 48, 0]] = f32::NAN;
        let motion = Motion::from_joints(FrameRate::new(15, 1), joints);
        assert!(!motion.mask[[2, 48]] && motion.mask[[1, 48]]);
        write(&path, &motion).unwrap();
        let again = read(&path, FrameRate::new(15, 1)).unwrap();
        assert_eq!(again.mask, motion.mask);
        assert!(again.joints.iter().zip(&motion.joints).all(|(a, b)| a.to_bits() == b.to_bits()));

        Array3::<f32>::zeros((4, 43, 3)).write_npy(File::create(&path).unwrap()).unwrap();
        let error = read(&path, FrameRate::new(15, 1)).unwrap_err().to_string();
        assert!(error.contains("[4, 43, 3]"), "{error}");
        std::fs::write(&path, "no array").unwrap();
        assert!(read(&path, FrameRate::new(15, 1)).is_err());
    }
}
