//! Motion files: recognised formats and names.

use ndarray::{Array, Array2, Array3};
use ndarray_npy::WriteNpyExt as _;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use orator_formats::joints_npz;
use orator_formats::mocap::motion_file::{DEFAULT_FPS, read};
use std::fs::File;
use std::path::Path;

#[test]
fn all_array_layouts_give_the_same_motion() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let joints = Array3::from_shape_fn((5, N_JOINTS, 3), |(t, j, k)| (t * 147 + j * 3 + k) as f32 / 1024.0);
    joints.write_npy(File::create(at("a.npy")).unwrap()).unwrap();
    joints.mapv(f64::from).write_npy(File::create(at("b.npy")).unwrap()).unwrap();
    let flat = joints.clone().into_shape_with_order((5, 147)).unwrap();
    flat.write_npy(File::create(at("c.npy")).unwrap()).unwrap();
    let fps = FrameRate::new(30, 1);
    let mut motion = Motion::from_joints(fps, joints.clone());
    motion.mask[[2, 5]] = false;
    joints_npz::write(&at("d.npz"), &motion).unwrap();
    for name in ["a.npy", "b.npy", "c.npy"] {
        let found = read(&at(name), Some(fps)).unwrap();
        assert!(found.motion.joints == joints && found.motion.fps == fps && found.notes.is_empty(), "{name}");
        let found = read(&at(name), None).unwrap();
        assert!(found.motion.fps == DEFAULT_FPS && found.notes[0].contains("--input-fps"), "{name}");
    }
    assert_eq!(read(&at("d.npz"), Some(FrameRate::new(7, 1))).unwrap().motion, motion);
}

#[test]
fn invalid_files_are_rejected_with_a_reason() {
    let dir = tempfile::tempdir().unwrap();
    let error_of = |name: &str, write: &dyn Fn(&Path)| {
        let path = dir.path().join(name);
        write(&path);
        format!("{:#}", read(&path, None).unwrap_err())
    };
    let npy = |shape: (usize, usize, usize), value: f32| {
        move |path: &Path| Array3::from_elem(shape, value).write_npy(File::create(path).unwrap()).unwrap()
    };
    let (integers, flat) = (Array2::<i32>::zeros((4, 147)), Array::<f32, _>::zeros(147));
    let cases = [
        (error_of("gone.npy", &|_| ()), "cannot read"),
        (error_of("empty.npy", &|path| std::fs::write(path, "").unwrap()), "is empty"),
        (error_of("joints.npy", &npy((4, 43, 3), 0.0)), "[4, 43, 3]"),
        (error_of("none.npy", &npy((0, 49, 3), 0.0)), "no frame"),
        (error_of("nan.npy", &npy((4, 49, 3), f32::NAN)), "all joints of all 4 frames are missing"),
        (error_of("whole.npy", &|path| integers.write_npy(File::create(path).unwrap()).unwrap()), "float"),
        (error_of("a.mp4", &|path| std::fs::write(path, "x").unwrap()), "expected .npy"),
        (error_of("a.txt", &|path| std::fs::write(path, "1 2 3\n").unwrap()), "147"),
        (error_of("a.bvh", &|path| std::fs::write(path, "x").unwrap()), "a.bvh"),
        (error_of("flat.npy", &|path| flat.write_npy(File::create(path).unwrap()).unwrap()), "[147]"),
    ];
    for (text, expected) in cases {
        assert!(text.contains(expected), "{expected}: {text}");
    }
}
