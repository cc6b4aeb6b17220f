//! Unit tests of `orator_formats::joints_npz`.

use ndarray::Array3;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use orator_formats::joints_npz::{read, read_extra, write, write_lifted};

#[test]
fn nose_and_hips_are_stored_with_the_joints() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("joints.npz");
    let joints = Array3::from_shape_fn((2, N_JOINTS, 3), |(t, joint, k)| (t + joint + k) as f32 * 0.1);
    let mut motion = Motion::from_joints(FrameRate::new(30_000, 1001), joints);
    motion.mask[[1, 3]] = false;
    write(&path, &motion).unwrap();
    assert_eq!(read_extra(&path).unwrap(), None);
    let extra = Array3::from_shape_fn((2, 3, 3), |(t, point, k)| (9 * t + 3 * point + k) as f32);
    write_lifted(&path, &motion, &extra).unwrap();
    assert_eq!((read(&path).unwrap(), read_extra(&path).unwrap()), (motion, Some(extra)));
}
