//! Lifting with the built-in weights against ground truth: projections of procedurally generated bodies and hands.

use crate::fixtures::keypoints::{POINTS, keypoints, lifter};
use ndarray::{Array3, s};
use ndarray_npy::{NpzWriter, read_npy};
use orator_base::motion::upper_body::{L_SHOULDER, NOSE, Pose, R_HIP, R_SHOULDER, metres_per_unit};
use orator_base::stage::artifacts::{self, StageName};
use orator_base::stage::ledger::{AcceptedInterval, Ledger};
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::pose2d::Keypoints;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, R_HAND};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_formats::keypoints_npz::Extras;
use orator_formats::timeline_npz::Timeline;
use orator_formats::{joints_npz, keypoints_npz};
use orator_lab::mocap::upper_body;
use orator_lab::train::scene::body::{FilmedScene, Filming};
use orator_nn::lifter::heatmap_network::{self, HeatmapLifter};
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use orator_pipeline::lift::LiftStage;
use orator_test_support::skip::real_data;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

/// Mean distance of shoulders, elbows and wrists in mm, both scaled to the reference size.
fn error_mm(motion: &Motion, truth: &[Pose]) -> f64 {
    let scale = metres_per_unit(truth);
    let (mut sum, mut n) = (0.0, 0);
    for (t, pose) in truth.iter().enumerate() {
        for (point, _, joint) in POINTS {
            let Some(joint) = joint else { continue };
            let square = |k: usize| (f64::from(motion.joints[[t, joint, k]]) - scale * pose[point][k]).powi(2);
            let distance = (0..3).map(square).sum::<f64>().sqrt();
            if distance.is_finite() {
                sum += 1000.0 * distance;
                n += 1;
            }
        }
    }
    assert!(n > truth.len() * 3, "most joints are finite");
    sum / f64::from(u32::try_from(n).unwrap())
}

#[test]
fn lifting_recovers_known_motion() {
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    let lifter = lifter();
    let (mut sum, mut constant_sum, n) = (0.0, 0.0, 20);
    for _ in 0..n {
        let scene = FilmedScene::from_rule(Filming::Drop, 90, &mut rng);
        let motion = lifter.lift(&keypoints(&scene, &mut rng)).unwrap();
        sum += error_mm(&motion, &scene.truth);
        // Baseline: the true pose of the first frame, held constant; better than a mean pose of other speakers.
        let mut constant = motion.clone();
        let scale = metres_per_unit(&scene.truth);
        for (point, _, joint) in POINTS {
            let Some(joint) = joint else { continue };
            let position = scene.truth[0][point].map(|v| (v * scale) as f32);
            constant.joints.slice_mut(s![.., joint, ..]).assign(&ndarray::arr1(&position));
        }
        constant_sum += error_mm(&constant, &scene.truth);
    }
    let (error, constant) = (sum / f64::from(n), constant_sum / f64::from(n));
    eprintln!("lifted {error:.0} mm, constant first pose {constant:.0} mm");
    assert!(error < 80.0 && error < 0.8 * constant, "{error} {constant}");
}

#[test]
fn hands_are_attached_to_the_wrists_and_bone_lengths_are_constant() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let scene = FilmedScene::from_rule(Filming::Clean, 60, &mut rng);
    let mut keypoints = keypoints(&scene, &mut rng);
    keypoints.left_hand.slice_mut(s![10..20, .., ..]).fill(0.0); // a short gap: filled
    keypoints.right_hand.slice_mut(s![30.., .., ..]).fill(0.0); // a long one: missing
    let motion = lifter().lift(&keypoints).unwrap();
    for t in 0..60 {
        for (hand, wrist) in [(L_HAND, skeleton::L_WRIST), (R_HAND, skeleton::R_WRIST)] {
            assert_eq!(motion.joints.slice(s![t, hand, ..]), motion.joints.slice(s![t, wrist, ..]));
        }
        assert_eq!(motion.joints.slice(s![t, 0, ..]).to_vec(), [0.0; 3]);
        assert_eq!(motion.joints[[t, R_HAND + 8, 0]].is_nan(), t >= 30);
        assert!(motion.joints[[t, L_HAND + 8, 0]].is_finite());
        assert_eq!(motion.mask[[t, L_HAND + 8]], !(10..20).contains(&t));
    }
    for joint in 1..N_JOINTS {
        let parent = skeleton::parent(joint).unwrap();
        let bone = |t: usize| {
            let step = &motion.joints.slice(s![t, joint, ..]) - &motion.joints.slice(s![t, parent, ..]);
            step.mapv(|v| v * v).sum().sqrt()
        };
        assert!((0..30).all(|t| (bone(t) - bone(0)).abs() < 1e-5), "{}", skeleton::name(joint));
    }
    // The hands are upright and open: fingers above the wrist, thumbs towards the middle of the body.
    let at = |joint: usize, k: usize| motion.joints[[5, joint, k]];
    for (root, inward) in [(R_HAND, 1.0), (L_HAND, -1.0)] {
        assert!(at(root + 9, 1) < at(root, 1) - 0.04, "the middle knuckle is above the wrist");
        assert!(inward * (at(root + 5, 0) - at(root + 17, 0)) > 0.0, "the index is on the inner side");
    }
}

#[test]
fn intervals_are_lifted_separately_and_other_frames_are_missing() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let keypoints = keypoints(&FilmedScene::from_rule(Filming::Training, 80, &mut rng), &mut rng);
    let intervals = [Interval { start: 5, end: 30 }, Interval { start: 40, end: 80 }];
    let lifter = lifter();
    let lifted = lifter.lift_intervals(&keypoints, &intervals).unwrap();
    for t in 0..80 {
        let inside = intervals.iter().any(|i| (i.start..i.end).contains(&t));
        assert_eq!(lifted.motion.joints[[t, 0, 0]].is_nan(), !inside, "frame {t}");
        assert!(inside || lifted.motion.mask.slice(s![t, ..]).iter().all(|m| !m));
    }
    assert_eq!(lifted.n_frames, 65);
    assert_eq!(lifted.extra.dim(), (80, 3, 3));
    let nose = |t: usize| lifted.extra[[t, 0, 1]];
    assert!(nose(2).is_nan() && (5..30).all(|t| (-0.4..0.0).contains(&nose(t))), "a nose above the neck");
    let again = lifter.lift_intervals(&keypoints, &intervals).unwrap();
    assert!(lifted.motion.joints.iter().zip(&again.motion.joints).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert!(lifter.lift_intervals(&keypoints, &[Interval { start: 70, end: 81 }]).is_err());
    let none = lifter.lift_intervals(&keypoints, &[]).unwrap();
    assert_eq!((none.n_frames, none.lengths[skeleton::R_HAND]), (0, 0.0));
}

#[test]
fn a_finger_tip_that_is_never_detected_gets_a_plausible_length() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut k = keypoints(&FilmedScene::from_rule(Filming::Clean, 40, &mut rng), &mut rng);
    k.left_hand.slice_mut(s![.., 20, 2]).fill(0.0);
    k.right_hand.slice_mut(s![.., 20, 2]).fill(0.0);
    let lifted = lifter().lift_intervals(&k, &[Interval { start: 0, end: 40 }]).unwrap();
    for root in [L_HAND, R_HAND] {
        for joint in root + 1..root + 21 {
            let length = lifted.lengths[joint - 1];
            assert!((0.003..0.18).contains(&length), "{} is {length} m", skeleton::name(joint));
        }
        assert!(!lifted.motion.mask[[20, root + 20]] && lifted.motion.mask[[20, root + 19]]);
    }
}

/// Keypoints of a speaker with swinging arms, 6 s at `fps`.
fn swinging(fps: u32) -> Keypoints {
    let n = 6 * fps as usize;
    let mut body = Array3::zeros((n, 17, 3));
    for t in 0..n {
        let swing = |hertz: f32, by: f32| by * (std::f32::consts::TAU * hertz * t as f32 / fps as f32).sin();
        let (elbow, wrist) = (swing(0.4, 20.0), swing(0.7, 60.0));
        let points = [
            (0, 640.0, 180.0),
            (6, 560.0, 260.0),
            (8, 530.0 + elbow, 390.0),
            (10, 570.0 + wrist, 470.0 - wrist),
            (5, 720.0, 260.0),
            (7, 750.0 + elbow, 390.0),
            (9, 710.0 - wrist, 460.0 + elbow),
            (12, 590.0, 500.0),
            (11, 690.0, 500.0),
        ];
        for (point, x, y) in points {
            body.slice_mut(s![t, point, ..]).assign(&ndarray::arr1(&[x, y, 0.9]));
        }
    }
    let hand = Array3::zeros((n, 21, 3));
    Keypoints {
        fps: FrameRate::new(fps, 1),
        image_size: [1280, 720],
        body,
        left_hand: hand.clone(),
        right_hand: hand,
        hand_depth: None,
    }
}

#[test]
fn motion_does_not_depend_on_the_frame_rate() {
    let lifter = lifter();
    let motion = |fps| lifter.lift(&swinging(fps)).unwrap().joints;
    let expected = motion(15);
    for fps in [10, 20, 30] {
        let joints = motion(fps);
        // Multiples of 0.2 s are frame times at all these rates.
        let distance = |fifth: usize, joint: usize| {
            let a = joints.slice(s![fifth * fps as usize / 5, joint, ..]);
            let square = (&a - &expected.slice(s![fifth * 3, joint, ..])).mapv(|v| v * v);
            square.sum().sqrt()
        };
        let largest = (0..30).flat_map(|fifth| (1..7).map(move |joint| (fifth, joint)));
        let largest = largest.map(|(fifth, joint)| distance(fifth, joint)).fold(0.0, f32::max);
        eprintln!("{fps} fps: at most {:.1} mm from the motion at 15 fps", 1000.0 * largest);
        assert!(largest < 0.010, "{fps} fps: {largest} m");
    }
}

#[test]
fn non_finite_and_degenerate_keypoints_give_missing_or_finite_joints() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut k = keypoints(&FilmedScene::from_rule(Filming::Clean, 40, &mut rng), &mut rng);
    k.body.slice_mut(s![3..6, .., 0]).fill(f32::NAN);
    k.body.slice_mut(s![10..12, .., ..2]).fill(7.0);
    k.left_hand.fill(f32::INFINITY);
    k.right_hand.slice_mut(s![.., 3.., ..]).fill(1.0);
    let motion = lifter().lift(&k).unwrap();
    assert!(motion.joints.slice(s![.., L_HAND + 1.., 0]).iter().take(20).all(|v| v.is_nan()));
    assert!(motion.joints.slice(s![.., ..7, ..]).iter().all(|v| v.is_finite()));
    k.body.slice_mut(s![.., .., 2]).fill(0.0);
    let no_body = lifter().lift(&k).unwrap();
    assert!(no_body.joints.iter().all(|v| v.is_nan()) && no_body.mask.iter().all(|m| !m));
    k.body = Array3::zeros((0, 17, 3));
    assert!(lifter().lift(&k).is_err(), "arrays of unequal length");
    (k.left_hand, k.right_hand) = (Array3::zeros((0, 21, 3)), Array3::zeros((0, 21, 3)));
    assert_eq!(lifter().lift(&k).unwrap().n_frames(), 0);
}

fn orator(args: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_orator")).arg("lift").args(args).output().unwrap()
}

#[test]
fn the_command_lifts_a_body_without_hands_and_reports_bad_input() {
    let dir = tempfile::tempdir().unwrap();
    let (npz, out) = (dir.path().join("k.npz"), dir.path().join("j.npy"));
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let k = keypoints(&FilmedScene::from_rule(Filming::Clean, 40, &mut rng), &mut rng);
    let write = |name: &str, array: &Array3<f32>| {
        let mut file = NpzWriter::new(std::fs::File::create(&npz).unwrap());
        file.add_array(name, array).unwrap();
        file.finish().unwrap();
    };
    write("body", &k.body);
    let done = orator(&[&npz, Path::new("--out"), &out]);
    let text = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && text.contains("40 frames") && text.contains("no `fps`"), "{text}");
    let joints: Array3<f32> = read_npy(&out).unwrap();
    let before = std::fs::read(&out).unwrap();
    assert_eq!(joints.shape(), [40, 49, 3]);

    let fails = |args: &[&Path], expected: &str| {
        let failed = orator(args);
        let text = String::from_utf8_lossy(&failed.stderr).into_owned();
        assert!(failed.status.code() == Some(1) && text.contains(expected), "{text}");
    };
    let to = Path::new("--out");
    fails(&[&npz, to, &dir.path().join("j.bvh")], ".npy");
    fails(&[&dir.path().join("none.npz"), to, &out], "none.npz");
    write("bodies", &k.body);
    fails(&[&npz, to, &out], "give it with --input-fps");
    write("body", &k.left_hand);
    fails(&[&npz, to, &out], "[40, 21, 3]");
    write("body", &Array3::zeros((0, 17, 3)));
    fails(&[&npz, to, &out], "no frames");
    std::fs::write(&npz, b"no zip").unwrap();
    fails(&[&npz, to, &out], "k.npz");
    assert_eq!(std::fs::read(&out).unwrap(), before, "the existing output is unchanged");
}

/// Intervals of the video of `stage_inputs`, if it had `n_frames` frames.
fn stage_intervals(n_frames: usize) -> Vec<u8> {
    let intervals = Intervals::new(FrameRate::new(15, 1), n_frames, vec![Interval { start: 2, end: 68 }]);
    serde_json::to_vec(&intervals).unwrap()
}

/// Writes the files that the stage reads under `work`: 70 frames of a rule-based speaker, every third frame repeated.
fn stage_inputs(work: &Path) -> (Unit, Ledger) {
    let unit = Unit { speaker: "host".into(), video: "clip-00000000".into(), source: "clip.mp4".into() };
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let keypoints = keypoints(&FilmedScene::from_rule(Filming::Training, 70, &mut rng), &mut rng);
    let extras = Extras {
        time_secs: ndarray::Array1::linspace(0.0, 4.6, 70),
        person: ndarray::Array2::zeros((70, 5)),
        n_persons: ndarray::Array1::ones(70),
        identity: ndarray::Array1::zeros(70),
        other_hand: ndarray::Array2::from_elem((70, 2), false),
        face: None,
    };
    let [extract, pose2d, segment] =
        [StageName::Extract, StageName::Pose2d, StageName::Segment].map(|stage| artifacts::dir(work, stage, &unit));
    [&extract, &pose2d, &segment].into_iter().for_each(|folder| std::fs::create_dir_all(folder).unwrap());
    let timeline = Timeline {
        source_secs: vec![0.0; 70],
        repeated: (0..70).map(|t| t % 3 == 2).collect(),
        shot_score: vec![0.0; 70],
        restart: vec![false; 70],
        span: vec![false; 70],
        frame_difference: vec![1.0; 70],
    };
    timeline.write(&extract.join("timeline.npz")).unwrap();
    keypoints_npz::write(&pose2d.join("keypoints.npz"), &keypoints, &extras).unwrap();
    std::fs::write(segment.join("intervals.json"), stage_intervals(70)).unwrap();
    let accepted = AcceptedInterval { start_secs: 0.0, end_secs: 4.4 };
    let ledger = Ledger { duration_secs: 4.4, accepted: vec![accepted], ..Ledger::default() };
    std::fs::write(segment.join("ledger.json"), serde_json::to_vec(&ledger).unwrap()).unwrap();
    (unit, ledger)
}

#[test]
fn the_stage_writes_joints_bones_and_ledger() {
    let dir = tempfile::tempdir().unwrap();
    let (unit, ledger) = stage_inputs(dir.path());
    let stage = LiftStage::new(&config::LiftConfig::default(), &config::SegmentConfig::default(), dir.path()).unwrap();
    assert!(stage.inputs(&unit).unwrap().iter().all(|input| input.path.exists()));
    let report = stage.run(&unit, dir.path(), &Silent).unwrap();
    assert!(report.line.starts_with("66 frames in 1 interval"), "{}", report.line);
    let motion = joints_npz::read(&dir.path().join("joints.npz")).unwrap();
    assert!(motion.joints[[1, 0, 0]].is_nan() && motion.joints[[2, 0, 0]] == 0.0);
    for t in 2..68 {
        let known = motion.mask.slice(s![t, ..]).iter().any(|m| *m);
        assert_eq!(known, t % 3 != 2, "a repeated frame is masked: {t}");
    }
    assert_eq!(Ledger::read(&dir.path().join("ledger.json")).unwrap(), ledger);
    let bones: serde_json::Value =
        serde_json::from_slice(&std::fs::read(dir.path().join("bones.json")).unwrap()).unwrap();
    let lengths: Vec<f64> = serde_json::from_value(bones["lengths_metres"].clone()).unwrap();
    assert_eq!((lengths.len(), bones["n_frames"].as_u64()), (48, Some(66)));
    assert!((lengths[0] * 2.0 + lengths[1] + lengths[2] - 0.90).abs() < 1e-3, "the reference body size");
    let phalanx = lengths[skeleton::L_HAND + 9] / lengths[2];
    assert!((0.15..0.25).contains(&phalanx), "a phalanx is about a fifth of the forearm: {phalanx}");

    let segment = artifacts::dir(dir.path(), StageName::Segment, &unit);
    std::fs::write(segment.join("intervals.json"), stage_intervals(71)).unwrap();
    let text = format!("{:#}", stage.run(&unit, dir.path(), &Silent).unwrap_err());
    assert!(text.contains("segment again"), "{text}");
}

#[test]
fn hand_weights_of_either_network_are_loaded_by_their_file() {
    let dir = tempfile::tempdir().unwrap();
    let (unit, _) = stage_inputs(dir.path());
    let path = dir.path().join("hands.safetensors");
    let write = |kind: &str| {
        let mut params = Params::new(3);
        HeatmapLifter::new(&mut params, heatmap_network::NAME).unwrap();
        let mut contents = Contents { facts: serde_json::json!({ "kind": kind }), tensors: BTreeMap::new() };
        contents.add("", params.tensors().unwrap());
        contents.write(&path).unwrap();
    };
    let settings = config::LiftConfig { hand_weights: path.clone(), ..config::LiftConfig::default() };
    let stage = |settings: &config::LiftConfig| LiftStage::new(settings, &config::SegmentConfig::default(), dir.path());
    write(heatmap_network::KIND);
    assert!(stage(&settings).unwrap().inputs(&unit).unwrap().iter().any(|input| input.path == path));
    let lifted = |settings: &config::LiftConfig| {
        stage(settings).unwrap().run(&unit, dir.path(), &Silent).unwrap();
        let bones: serde_json::Value =
            serde_json::from_slice(&std::fs::read(dir.path().join("bones.json")).unwrap()).unwrap();
        let lengths: Vec<f64> = serde_json::from_value(bones["lengths_metres"].clone()).unwrap();
        (joints_npz::read(&dir.path().join("joints.npz")).unwrap().joints, lengths)
    };
    let (built_in, _) = lifted(&config::LiftConfig::default());
    let (joints, lengths) = lifted(&settings);
    let hands = |joints: &Array3<f32>| joints.slice(s![.., L_HAND.., ..]).to_owned();
    let (hands, built_in) = (hands(&joints), hands(&built_in));
    assert!(hands.iter().zip(&built_in).all(|(a, b)| a.is_finite() == b.is_finite()));
    assert!(hands.iter().zip(&built_in).any(|(a, b)| (a - b).abs() > 0.01), "the hands are those of the file");
    // An untrained network has no shape of a hand, but its size follows from the forearm.
    let size = lengths[L_HAND..L_HAND + 20].iter().sum::<f64>() / lengths[2];
    assert!((2.9..4.4).contains(&size), "the bones of a hand are {size} forearms long");

    let error = || format!("{:#}", stage(&settings).err().unwrap());
    write("voice");
    let text = error();
    assert!(text.contains("hands.safetensors") && text.contains("hand-lifter or hand-heatmap-lifter"), "{text}");
    write(heatmap_network::KIND);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(error().contains("hands.safetensors"), "{}", error());
    let few = Contents { facts: serde_json::json!({ "kind": heatmap_network::KIND }), tensors: BTreeMap::new() };
    few.write(&path).unwrap();
    let text = error();
    assert!(text.contains("hands.safetensors") && text.contains("0 weights"), "{text}");
}

#[test]
fn captured_gestures_are_upright_and_face_forward() {
    let Some(file) = real_data("data/mocap/cmu_gestures_joints38_mm.npz") else { return };
    let takes = upper_body::read_all(&[file]).unwrap();
    let (mut upright, mut ahead, mut n) = (0, 0, 0);
    for pose in takes.iter().flat_map(|take| take.poses.iter().step_by(60)) {
        n += 1;
        upright += usize::from(pose[NOSE][1] < 0.0 && pose[R_HIP][1] > 0.2);
        // Seen from above, the nose is in front of the line of the shoulders.
        let [x, _, z] = [0, 1, 2].map(|k| pose[L_SHOULDER][k] - pose[R_SHOULDER][k]);
        ahead += usize::from(pose[NOSE][0] * z - pose[NOSE][2] * x > 0.0);
    }
    assert!(takes.len() >= 13 && n > 300, "{} takes, {n} frames", takes.len());
    assert!(upright * 20 > n * 19 && ahead * 20 > n * 19, "{upright} {ahead} of {n}");
}
