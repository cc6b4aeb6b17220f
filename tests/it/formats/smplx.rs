//! SMPL-X and SMPL-H files: forward kinematics as of a numpy script, every layout of the field, invalid files, and round
//! trips through files that are also read by numpy.

use crate::fixtures::figures::swinging;
use ndarray::{Array, Array1, Array2, ArrayD, IxDyn, arr0, s};
use ndarray_npy::NpzWriter;
use orator_avatar::animate::export::smplx;
use orator_avatar::animate::retarget::captured_body::{CapturedBody, CapturedPart};
use orator_avatar::animate::{AnimationOptions, Constraints, Performance, Smoothing, perform, perform_captured};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, norm, sub};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, R_HAND, R_SHOULDER, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_formats::mocap::captured::{self, MotionKind};
use orator_formats::mocap::motion_file;
use orator_formats::mocap::smplx::body::{self, N_POINTS, N_SMPLX};
use orator_formats::mocap::smplx::motion::SmplxMotion;
use orator_test_support::skip::{readers, real_data};
use serde_json::Value;
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};
use std::process::Command;
type NamedArrays = Vec<(&'static str, ArrayD<f64>)>;

const SCRIPT: &str = "fixtures/reference/smplx_reference.py";
const THIRTY: FrameRate = FrameRate::new(30, 1);
fn untouched() -> AnimationOptions {
    let (smoothing, constraints, breath) = (Smoothing::None, Constraints::NONE, false);
    AnimationOptions { smoothing, constraints, breath, ..AnimationOptions::default() }
}

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn golden() -> Value {
    serde_json::from_str(&std::fs::read_to_string(project("fixtures/reference/smplx_golden.json")).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        value => vec![value.as_f64().unwrap()],
    }
}

fn points(value: &Value) -> Vec<Vec3> {
    numbers(value).chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect()
}

fn poses() -> Array2<f64> {
    Array2::from_shape_vec((5, 165), numbers(&golden()["poses"])).unwrap()
}

type Add<'a> = &'a dyn Fn(&mut NpzWriter<std::fs::File>);

fn write_npz(path: &Path, add: Add) {
    let mut npz = NpzWriter::new(std::fs::File::create(path).unwrap());
    add(&mut npz);
    npz.finish().unwrap();
}

/// Writes float64 arrays and the frame rate 30.
fn write_arrays(path: &Path, arrays: &[(&str, ArrayD<f64>)]) {
    write_npz(path, &|npz| {
        arrays.iter().for_each(|(key, array)| npz.add_array(*key, array).unwrap());
        npz.add_array("mocap_frame_rate", &arr0(30i64)).unwrap();
    });
}

fn trans() -> ArrayD<f64> {
    Array::from_shape_vec(IxDyn(&[5, 3]), numbers(&golden()["trans"])).unwrap()
}

fn largest(a: impl IntoIterator<Item = Vec3>, b: impl IntoIterator<Item = Vec3>) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| norm(sub(a, b))).fold(0.0, f64::max)
}

/// Largest distance of visible joints, mm.
fn worst_mm(a: &Motion, b: &Motion) -> f64 {
    assert_eq!((a.n_frames(), &a.mask), (b.n_frames(), &b.mask));
    let joints = |motion: &Motion| motion.joints.iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
    let [a, b] = [joints(a), joints(b)];
    let all = |joints: &[f64]| joints.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect::<Vec<Vec3>>();
    1000.0 * largest(all(&a), all(&b))
}

#[test]
fn forward_kinematics_equals_that_of_numpy() {
    let (dir, golden) = (tempfile::tempdir().unwrap(), golden());
    let path = dir.path().join("a.npz");
    write_arrays(&path, &[("poses", poses().into_dyn()), ("trans", trans())]);
    assert!(largest(body::rest(), points(&golden["rest"])) < 1e-6);
    let motion = SmplxMotion::read(&path, None).unwrap();
    let ours = (0..5).flat_map(|t| motion.positions(t));
    let worst = largest(ours, points(&golden["positions"]));
    assert!(worst < 1e-6, "{worst} m");
    // The 49 joints are those of the file, in the axes of this program.
    let read = motion_file::read(&path, None).unwrap();
    assert!(read.has_rate && read.motion.fps == THIRTY && read.notes.is_empty(), "{:?}", read.notes);
    let joints = read.motion.joints.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
    let worst = largest(joints.chunks_exact(3).map(|v| [v[0], v[1], v[2]]), points(&golden["joints"]));
    assert!(worst < 1e-6, "{worst} m");
    assert!(read.motion.mask.iter().all(|visible| *visible));
    // An import turns the speaker to the camera.
    let imported = captured::read(MotionKind::Smplx, &path).unwrap();
    assert!(imported.facts["turned_degrees"].as_f64().unwrap().abs() < 30.0, "{:?}", imported.facts);
}

#[test]
fn every_layout_gives_the_same_joints() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.npz");
    let poses = poses();
    write_arrays(&path, &[("poses", poses.clone().into_dyn())]);
    let known = motion_file::read(&path, None).unwrap().motion;
    let part = |first: usize, n: usize, shape: &[usize]| {
        let columns = poses.slice(s![.., 3 * first..3 * (first + n)]).to_owned();
        (columns.into_shape_with_order(IxDyn(shape)).unwrap_or_else(|_| panic!("{shape:?}"))).into_dyn()
    };
    let rows = |first: usize, n: usize| part(first, n, &[5, 3 * n]);
    let smplh = ndarray::concatenate![ndarray::Axis(1), poses.slice(s![.., ..66]), poses.slice(s![.., 75..])];
    let layouts: [(&str, NamedArrays); 5] = [
        ("joints by vectors", vec![("poses", part(0, 55, &[5, 55, 3]))]),
        ("SMPL-H", vec![("poses", smplh.into_dyn()), ("betas", ArrayD::zeros(IxDyn(&[16]))), ("trans", trans())]),
        ("AMASS", vec![("root_orient", rows(0, 1)), ("pose_body", rows(1, 21)), ("pose_hand", rows(25, 30))]),
        (
            "Seamless Interaction",
            vec![
                ("smplh:global_orient", rows(0, 1)),
                ("smplh:body_pose", part(1, 21, &[5, 21, 3])),
                ("smplh:left_hand_pose", part(25, 15, &[5, 15, 3])),
                ("smplh:right_hand_pose", part(40, 15, &[5, 15, 3])),
                ("smplh:translation", trans()),
                ("smplh:is_valid", ArrayD::ones(IxDyn(&[5, 1]))),
            ],
        ),
        ("float32", vec![("poses", poses.mapv(|v| f64::from(v as f32)).into_dyn())]),
    ];
    for (name, arrays) in &layouts {
        write_arrays(&path, arrays);
        let worst = worst_mm(&motion_file::read(&path, None).unwrap().motion, &known);
        assert!(worst < 1e-3, "{name}: {worst} mm");
    }
    // Seamless Interaction: 30 fps by definition, frames without a person, and the axes of a camera (half a turn about
    // x), of which the legs are not read.
    let (half_turn, seamless) =
        (rows(0, 1).mapv(|_| 0.0) + &Array1::from_vec(vec![std::f64::consts::PI, 0.0, 0.0]), &layouts[3].1);
    write_npz(&path, &|npz| {
        npz.add_array(seamless[0].0, &half_turn).unwrap();
        seamless[1..4].iter().for_each(|(key, array)| npz.add_array(*key, array).unwrap());
        npz.add_array("smplh:is_valid", &Array1::from_vec(vec![true, true, false, true, true])).unwrap();
    });
    for fps in [None, Some(FrameRate::new(15, 1))] {
        let read = motion_file::read(&path, fps).unwrap();
        assert!(read.has_rate && read.motion.fps == THIRTY);
        let seen: Vec<bool> = read.motion.mask.column(L_WRIST).to_vec();
        assert_eq!(seen, [true, true, false, true, true]);
        let body = CapturedBody::read(&path, None).unwrap().unwrap();
        assert_eq!(body.parts(), [CapturedPart::Head, CapturedPart::Spine]);
        assert!(
            read.motion.joints[[0, L_HAND + 4, 1]].is_finite() && read.notes[0].contains("rotated"),
            "{:?}",
            read.notes
        );
    }
    assert_eq!(captured::read(MotionKind::Smplx, &path).unwrap().facts["source_up"], "-y");
    // AMASS is z up: a quarter turn about x.
    let quarter = rows(0, 1).mapv(|_| 0.0) + &Array1::from_vec(vec![FRAC_PI_2, 0.0, 0.0]);
    write_arrays(&path, &[("root_orient", quarter), layouts[2].1[1].clone(), layouts[2].1[2].clone()]);
    assert_eq!(captured::read(MotionKind::Smplx, &path).unwrap().facts["source_up"], "+z");
}

#[test]
fn invalid_files_are_rejected_with_key_and_shape() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.npz");
    let zeros = |shape: &[usize]| ArrayD::<f64>::zeros(IxDyn(shape));
    let mut nan = zeros(&[4, 165]);
    nan[[2, 70]] = f64::NAN;
    let [root, body, hand] =
        [("root_orient", 3), ("pose_body", 63), ("pose_hand", 90)].map(|(key, n)| (key, zeros(&[4, n])));
    let cases: Vec<(NamedArrays, &[&str])> = vec![
        (vec![("poses", nan)], &["`poses`, shape [4, 165]: frame 2 has a number that is not finite"]),
        (vec![("poses", zeros(&[660]))], &["`poses` has shape [660], expected [T, 165] or [T, 156]"]),
        (vec![("poses", zeros(&[4, 72]))], &["`poses` has shape [4, 72], expected [T, 165] or [T, 156]"]),
        (vec![("poses", zeros(&[4, 3, 55]))], &["`poses` has shape [4, 3, 55]"]),
        (
            vec![("poses", zeros(&[4, 78]))],
            &["`poses` has shape [4, 78]", "coefficients of hands (PCA)", "use_pca=False"],
        ),
        (
            vec![root.clone(), body.clone(), ("pose_hand", zeros(&[4, 24]))],
            &["`pose_hand` has shape [4, 24], expected [T, 90]", "PCA"],
        ),
        (vec![root.clone(), body.clone()], &["no array `pose_hand`", "found: root_orient, pose_body"]),
        (vec![body.clone(), hand.clone()], &["no array `root_orient`"]),
        (vec![root, body, ("pose_hand", zeros(&[5, 90]))], &["`pose_hand` has shape [5, 90], expected 4 frames"]),
        (vec![("poses", zeros(&[4, 165])), ("trans", zeros(&[3, 3]))], &["`trans` has shape [3, 3], expected [4, 3]"]),
        (
            vec![("poses", zeros(&[4, 165])), ("trans", zeros(&[4, 3]) + f64::INFINITY)],
            &["`trans`, shape [4, 3]: a number"],
        ),
        (
            vec![("poses", zeros(&[4, 165])), ("orator_rest_joints", zeros(&[55, 3]))],
            &["`orator_rest_joints` has shape [55, 3], expected [65, 3]"],
        ),
        (vec![("poses", zeros(&[0, 165]))], &["a.npz"]),
    ];
    for (arrays, expected) in cases {
        write_arrays(&path, &arrays);
        let text = format!("{:#}", motion_file::read(&path, None).unwrap_err());
        assert!(text.contains("a.npz"), "{text}");
        expected.iter().for_each(|expected| assert!(text.contains(expected), "{expected}: {text}"));
    }
    write_npz(&path, &|npz| npz.add_array("poses", &zeros(&[4, 165])).unwrap());
    let text = format!("{:#}", motion_file::read(&path, None).unwrap_err());
    assert!(text.contains("`mocap_frame_rate`") && text.contains("--input-fps"), "{text}");
    let read = motion_file::read_at(&path, Some(THIRTY), None).unwrap();
    assert!(!read.has_rate && read.motion.fps == THIRTY);
    write_arrays(&path, &[("poses", zeros(&[4, 165]))]);
    assert!(motion_file::read_at(&path, Some(FrameRate::new(25, 1)), None).is_err());
    assert!(motion_file::read_at(&path, None, Some("cm".parse().unwrap())).is_err());
    let part = |key: &'static str, n: usize| (key, zeros(&[4, n, 3]));
    let parts = [part("smplh:global_orient", 1), part("smplh:body_pose", 21), part("smplh:left_hand_pose", 15)];
    let parts = parts.into_iter().chain([part("smplh:right_hand_pose", 15), ("smplh:is_valid", zeros(&[9]))]);
    write_arrays(&path, &parts.collect::<Vec<_>>());
    let text = format!("{:#}", motion_file::read(&path, None).unwrap_err());
    assert!(text.contains("`smplh:global_orient` has shape [4, 1, 3], expected 9 frames"), "{text}");
}

/// Writes a performance and reads it back.
fn written(path: &Path, performance: &Performance) -> (SmplxMotion, SmplxMotion) {
    let motion = smplx::motion(performance);
    motion.write(path).unwrap();
    (SmplxMotion::read(path, None).unwrap(), motion)
}

#[test]
fn files_reproduce_rotations_and_joints() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.smplx.npz");
    for (seed, fps) in [(0, FrameRate::new(30_000, 1001)), (1, FrameRate::new(15, 1))] {
        let own =
            perform(&swinging(seed, 40), None, &AnimationOptions { fps: Some(fps), ..AnimationOptions::default() });
        let (read, known) = written(&path, &own);
        assert_eq!((read.fps, read.rotations.len()), (fps, known.rotations.len()));
        let pairs = read.rotations.iter().flatten().zip(known.rotations.iter().flatten());
        let degrees = pairs.map(|(a, b)| (a.inverse() * *b).angle().to_degrees()).fold(0.0, f64::max);
        assert!(degrees < 0.01, "{degrees} degrees");
        let positions =
            |motion: &SmplxMotion| (0..motion.rotations.len()).flat_map(|t| motion.positions(t)).collect::<Vec<_>>();
        assert!(largest(positions(&read), positions(&known)) < 1e-5);
        let again = motion_file::read(&path, None).unwrap();
        assert!(again.notes.is_empty(), "{:?}", again.notes);
        let worst = worst_mm(&again.motion, &own.motion());
        assert!(worst < 0.05, "{worst} mm");

        // 49 joints with rigid hands to SMPL-X to 49 joints.
        let joints = own.motion();
        written(&path, &perform(&joints, None, &untouched()));
        let worst = worst_mm(&motion_file::read(&path, None).unwrap().motion, &joints);
        eprintln!("49 joints to SMPL-X to 49 joints: {worst:.3} mm");
        assert!(worst < 3.0, "{worst} mm");
        // The figure stands on the floor, and its head, trunk and legs are read too.
        let feet = [10, 11].map(|toe| SmplxMotion::read(&path, None).unwrap().positions(0)[toe][1]);
        assert!(feet.iter().all(|y| y.abs() < 0.06), "{feet:?}");
        let body = CapturedBody::read(&path, None).unwrap().unwrap();
        assert_eq!(body.parts(), [CapturedPart::Head, CapturedPart::Spine, CapturedPart::Legs]);
    }
}

/// What the numpy script reads from a file.
fn by_numpy(readers: &Path, path: &Path, step: usize) -> Value {
    let mut command = Command::new("python3");
    let output =
        command.arg(project(SCRIPT)).arg(path).arg(step.to_string()).env("PYTHONPATH", readers).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn numpy_reads_what_is_written() {
    let Some(readers) = readers("numpy") else { return };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.smplx.npz");
    let own = perform(&swinging(3, 25), None, &AnimationOptions { fps: Some(THIRTY), ..AnimationOptions::default() });
    written(&path, &own);
    let found = by_numpy(&readers, &path, 1);
    assert_eq!(found["fps"], 30.0);
    let at = points(&found["positions"]);
    let joints = own.motion();
    assert_eq!(at.len(), N_POINTS * joints.n_frames());
    let ours = |t: usize, joint: usize| -> Vec3 { std::array::from_fn(|k| f64::from(joints.joints[[t, joint, k]])) };
    for (t, at) in at.chunks_exact(N_POINTS).enumerate() {
        let neck = at[12];
        let hands = [(0, L_HAND), (1, R_HAND)].into_iter();
        let hands = hands.flat_map(|(side, root)| body::hand_points(side).map(move |(point, k)| (k, root + point)));
        for (k, joint) in [(20, L_WRIST), (21, R_WRIST), (18, L_WRIST - 1), (16, L_WRIST - 2)].into_iter().chain(hands)
        {
            let [x, y, z] = sub(at[k], neck);
            let off = norm(sub([x, -y, -z], ours(t, joint)));
            assert!(off < 1e-4, "frame {t}, joint {joint}: {off} m");
        }
    }
}

#[test]
fn a_clip_of_beat2_has_the_joints_of_numpy_and_keeps_its_body() {
    let Some(path) = real_data("data/speech_motion/beat2_2_scott_0_1_1_smplx30fps.npz") else { return };
    let motion = SmplxMotion::read(&path, None).unwrap();
    assert_eq!((motion.fps, motion.rotations.len()), (THIRTY, 1906));
    let read = motion_file::read(&path, None).unwrap();
    assert_eq!((read.motion.n_frames(), read.notes.len()), (1906, 0));
    let body = CapturedBody::read(&path, None).unwrap().unwrap();
    assert_eq!(body.parts(), [CapturedPart::Head, CapturedPart::Spine, CapturedPart::Legs]);
    let dir = tempfile::tempdir().unwrap();
    let own = perform_captured(&read.motion, &body, &untouched());
    let (again, _) = written(&dir.path().join("a.smplx.npz"), &own);
    assert!(again.positions(0)[0][1] > 0.8, "the hips are above the floor");
    // The rig has rigid shoulders, those of the clip move: hands keep their positions from the middle of the shoulders.
    let from_shoulders = |motion: &Motion, t: usize, joint: usize| -> Vec3 {
        let at = |joint: usize, k: usize| f64::from(motion.joints[[t, joint, k]]);
        std::array::from_fn(|k| at(joint, k) - (at(R_SHOULDER, k) + at(L_SHOULDER, k)) / 2.0)
    };
    let hands = |motion: &Motion| {
        let joints = (0..1906).flat_map(|t| (L_HAND..N_JOINTS).map(move |joint| (t, joint)));
        joints.map(|(t, joint)| from_shoulders(motion, t, joint)).collect::<Vec<Vec3>>()
    };
    let worst = 1000.0 * largest(hands(&own.motion()), hands(&read.motion));
    eprintln!("BEAT2 on our rig: hands {worst:.3} mm");
    assert!(worst < 10.0, "{worst} mm");
    let Some(readers) = readers("numpy") else { return };
    let step = 10;
    let known = points(&by_numpy(&readers, &path, step)["positions"]);
    let ours = (0..1906).step_by(step).flat_map(|t| motion.positions(t));
    let worst = 1000.0 * largest(ours, known);
    eprintln!("BEAT2 beside numpy: {worst:.6} mm");
    assert!(worst < 0.1, "{worst} mm");
}

const LEFT_SHOULDER: usize = 16;
const LEFT_ELBOW: usize = 18;
const LEFT_WRIST: usize = 20;

/// Positions relative to the pelvis.
fn turned(turns: &[(usize, Vec3)]) -> Vec<Vec3> {
    let mut rotations = [Rotation::IDENTITY; N_SMPLX];
    for &(joint, vector) in turns {
        rotations[joint] = Rotation::from_rotation_vector(vector);
    }
    body::skeleton(&body::rest()).positions([0.0; 3], &body::local(&rotations))
}

fn assert_close(a: Vec3, b: Vec3) {
    assert!(norm(sub(a, b)) < 1e-12, "{a:?} {b:?}");
}

#[test]
fn a_quarter_turn_of_the_shoulder_raises_the_arm_and_moves_nothing_else() {
    let (rest, raised) = (turned(&[]), turned(&[(LEFT_SHOULDER, [0.0, 0.0, FRAC_PI_2])]));
    assert_close(rest[LEFT_WRIST], [0.71, 0.46, 0.0]);
    assert_close(raised[LEFT_ELBOW], [0.18, 0.46 + 0.28, 0.0]);
    assert_close(raised[LEFT_WRIST], [0.18, 0.46 + 0.53, 0.0]);
    let mut moved: Vec<usize> = (0..raised.len()).filter(|&k| norm(sub(raised[k], rest[k])) > 1e-9).collect();
    let arm = [LEFT_ELBOW, LEFT_WRIST].into_iter().chain(25..40).chain(55..60);
    assert_eq!(moved, arm.collect::<Vec<_>>());
    // A rotation moves the children of its joint only.
    let bent = turned(&[(LEFT_ELBOW, [0.0, -FRAC_PI_2, 0.0])]);
    moved.retain(|&k| norm(sub(bent[k], rest[k])) < 1e-9);
    assert_eq!(moved, [LEFT_ELBOW]);
    assert_close(bent[LEFT_WRIST], [0.46, 0.46, 0.25]);
}

#[test]
fn the_rotation_of_a_joint_applies_in_the_axes_of_its_parent() {
    // The shoulder's turn about z takes the elbow's axis -y to x, about which the forearm turns from y to z.
    let both = turned(&[(LEFT_SHOULDER, [0.0, 0.0, FRAC_PI_2]), (LEFT_ELBOW, [0.0, -FRAC_PI_2, 0.0])]);
    assert_close(both[LEFT_ELBOW], [0.18, 0.74, 0.0]);
    assert_close(both[LEFT_WRIST], [0.18, 0.74, 0.25]);
    // The opposite order would give a forearm that points up: Ry(-90) Rz(90) x = y.
    let hips = turned(&[(0, [0.0, FRAC_PI_2, 0.0]), (LEFT_SHOULDER, [0.0, 0.0, FRAC_PI_2])]);
    assert_close(hips[LEFT_WRIST], [0.0, 0.46 + 0.53, -0.18]);
}

#[test]
fn every_finger_point_has_its_joint_and_the_hands_are_mirrored() {
    let rest = turned(&[]);
    let pairs: Vec<((usize, usize), (usize, usize))> = body::hand_points(0).zip(body::hand_points(1)).collect();
    for &((point, left), (other, right)) in &pairs {
        assert_eq!(point, other);
        let [x, y, z] = rest[right];
        assert_close(rest[left], [-x, y, z]);
        assert!(rest[left][0] > rest[LEFT_WRIST][0]);
    }
    let mut points: Vec<usize> = pairs.iter().map(|((point, _), _)| *point).collect();
    points.sort_unstable();
    assert_eq!(points, (1..21).collect::<Vec<_>>());
}
