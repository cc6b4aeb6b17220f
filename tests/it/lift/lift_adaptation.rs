//! Adaptation of the body lifter to a speaker: lower errors for a body of unusual proportions, rejection, identical
//! bytes, and its place in a run.

use crate::fixtures::footage;
use orator::{Pipeline, Selection, Silent, StageName, load_config};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{self, Vec3};
use orator_base::motion::upper_body::{ARMS, BodyPoints, L_HIP, L_SHOULDER, NOSE, Pose, R_HIP, R_SHOULDER};
use orator_base::stage::artifacts::{self, adapted_weights};
use orator_base::stage::record::{Record, record_path};
use orator_nn::lifter::adapt::fine_tune::{AdaptedLifter, adapt};
use orator_nn::lifter::adapt::samples::{KeypointStretch, LiftedStretch};
use orator_nn::lifter::adapt::skeleton::{ArmLengths, arm_lengths, with_lengths};
use orator_nn::lifter::body::BodyLifter;
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use orator_pipeline::lift::weights;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

/// Number of frames of a stretch, at 15 frames per second.
const N_FRAMES: usize = 90;
/// Focal length in px, and the neck in camera axes in metres.
const FOCAL: f64 = 1920.0;
const NECK: Vec3 = [0.1, -0.2, 2.0];

/// Stretch `number` of a talk by a speaker of these proportions: gestures in front of a slowly turning body, in camera
/// axes.
fn talk(number: usize, [shoulders, upper_arm, forearm]: ArmLengths) -> Vec<Pose> {
    let pose = |t: usize| {
        let swing = |k: f64, hertz: f64| (TAU * hertz * t as f64 / 15.0 + 7.3 * number as f64 + 2.1 * k).sin();
        let mut pose: Pose = [[0.0; 3]; 9];
        pose[NOSE] = [0.04 * swing(0.0, 0.3), -0.17, -0.13];
        (pose[R_HIP], pose[L_HIP]) = ([-0.11, 0.5, 0.02], [0.11, 0.5, 0.02]);
        for (shoulder, side) in [(R_SHOULDER, -1.0), (L_SHOULDER, 1.0)] {
            let k = shoulder as f64;
            let along = |direction: Vec3, length: f64| vec3::scale(direction, length / vec3::norm(direction));
            let upper = [side * (0.3 + 0.25 * swing(k + 1.0, 0.4)), 0.9, -0.3 - 0.4 * swing(k + 2.0, 0.5)];
            let fore = [side * (0.1 + 0.6 * swing(k + 3.0, 0.6)), 0.1 + 0.7 * swing(k + 4.0, 0.45), -0.8];
            pose[shoulder] = [side * shoulders / 2.0, 0.0, 0.0];
            pose[shoulder + 1] = vec3::add(pose[shoulder], along(upper, upper_arm));
            pose[shoulder + 2] = vec3::add(pose[shoulder + 1], along(fore, forearm));
        }
        let turn = Rotation::about([0.0, 1.0, 0.0], 0.3 + 0.2 * swing(11.0, 0.1));
        pose.map(|p| turn.turn(p))
    };
    (0..N_FRAMES).map(pose).collect()
}

/// Keypoints of the poses with uniform noise of up to 2 % of the shoulder width.
fn film(poses: &[Pose], rng: &mut ChaCha8Rng) -> KeypointStretch {
    let mut frames: Vec<BodyPoints> = Vec::new();
    for pose in poses {
        frames.push(pose.map(|p| {
            let [x, y, z] = vec3::add(p, NECK);
            Some([x, y].map(|v| (FOCAL * v / z + rng.random_range(-5.8..5.8)) as f32))
        }));
    }
    KeypointStretch { frames, step: 1.0, centre_px: [0.0; 2], focal_px: FOCAL }
}

/// Network with these tensors.
fn lifter(like: &Contents, tensors: &BTreeMap<String, candle_core::Tensor>) -> BodyLifter {
    let config = serde_json::from_value(like.facts["lesson"]["config"].clone()).unwrap();
    let mut params = Params::frozen();
    let lifter = BodyLifter::new(&mut params, &config).unwrap();
    params.load(tensors).unwrap();
    lifter
}

/// Mean error of shoulders, elbows and wrists in metres, with constant bone lengths.
fn error(lifter: &BodyLifter, keypoints: &[KeypointStretch], truth: &[Vec<Pose>]) -> f64 {
    let lifted = LiftedStretch::all(lifter, keypoints).unwrap();
    assert_eq!(lifted.len(), truth.len());
    let lengths = arm_lengths(lifted.iter().flat_map(|stretch| &stretch.poses)).unwrap();
    let pairs = lifted.iter().flat_map(|stretch| &stretch.poses).zip(truth.iter().flatten());
    let errors: Vec<f64> = pairs
        .flat_map(|(pose, truth)| {
            let pose = with_lengths(pose, &lengths);
            ARMS.map(move |joint| vec3::norm(vec3::sub(pose[joint], truth[joint])))
        })
        .collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// Adapts the built-in lifter in rounds of `steps` steps.
fn adapted(training: &[KeypointStretch], held_out: &[KeypointStretch], steps: usize) -> (Contents, AdaptedLifter) {
    let base = weights::body_contents(Path::new("")).unwrap();
    let config = serde_json::from_value(base.facts["lesson"]["config"].clone()).unwrap();
    let adapted = adapt(&config, &base.tensors, [training, held_out], (steps, 1), &|| ()).unwrap();
    (base, adapted)
}

#[test]
fn unusual_proportions_are_lifted_with_lower_errors() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let truth: Vec<Vec<Pose>> = (0..15).map(|number| talk(number, [0.30, 0.36, 0.24])).collect();
    let keypoints: Vec<KeypointStretch> = truth.iter().map(|poses| film(poses, &mut rng)).collect();
    let (base, adapted) = adapted(&keypoints[..11], &keypoints[11..], 15);
    let [before, after] = adapted.errors;
    assert!(adapted.is_better() && after < 0.8 * before, "reprojection: {before:.4} to {after:.4} m");
    let [before, after] =
        [&base.tensors, &adapted.tensors].map(|tensors| error(&lifter(&base, tensors), &keypoints[11..], &truth[11..]));
    assert!(after < 0.85 * before, "joints: {before:.4} to {after:.4} m");
}

#[test]
fn keypoints_of_no_body_are_rejected() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut random = || {
        let frames = (0..N_FRAMES).map(|_| [(); 9].map(|()| Some([(); 2].map(|()| rng.random_range(0.0f32..700.0)))));
        KeypointStretch { frames: frames.collect(), step: 1.0, centre_px: [350.0; 2], focal_px: FOCAL }
    };
    let keypoints: Vec<KeypointStretch> = (0..6).map(|_| random()).collect();
    let (_, adapted) = adapted(&keypoints[..4], &keypoints[4..], 10);
    assert!(!adapted.is_better(), "{:?}", adapted.errors);
}

#[test]
fn any_number_of_threads_gives_the_same_weights() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let keypoints: Vec<KeypointStretch> =
        (0..3).map(|number| film(&talk(number, [0.34, 0.30, 0.26]), &mut rng)).collect();
    let bytes = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        let (base, adapted) = pool.install(|| adapted(&keypoints[..2], &keypoints[2..], 2));
        Contents { tensors: adapted.tensors, ..base }.to_bytes().unwrap()
    };
    let one = bytes(1);
    assert!(one == bytes(2) && one == bytes(1));
}

/// Pipeline of one speaker with these videos, and this value of `[lift] adapt`.
fn project(root: &Path, videos: &[&str], adapt: &str) -> Pipeline {
    let file = root.join("pipeline.toml");
    std::fs::write(&file, format!("[[speaker]]\nname = \"host\"\nvideos = {videos:?}\n")).unwrap();
    Pipeline::open(load_config(&file, &[format!("lift.adapt={adapt}")]).unwrap()).unwrap()
}

/// Writes keypoints and sound of the videos that have none yet, then runs `segment` and `lift`; returns the number of
/// lifts done.
fn run(pipeline: &Pipeline) -> usize {
    let work = &pipeline.config().settings.work.dir;
    for unit in &pipeline.videos(&[]).unwrap()[0].units {
        if !artifacts::dir(work, StageName::Extract, unit).exists() {
            footage::write(work, unit, &footage::good(360), &unit.video);
        }
    }
    let selection = Selection { from: StageName::Segment, to: StageName::Lift, ..Selection::default() };
    let report = pipeline.run(&selection, &Silent).unwrap();
    assert!(report.failures.is_empty(), "{:?}", report.failures);
    report.stages[&StageName::Lift].done
}

#[test]
fn a_run_adapts_once_and_ends_in_the_same_bytes_after_an_interruption() {
    let dir = tempfile::tempdir().unwrap();
    let one = project(dir.path(), &["a.mp4"], "off");
    let work = one.config().settings.work.dir.clone();
    let (folder, weights) = (artifacts::adapted(&work, "host"), adapted_weights(&work, "host"));
    assert_eq!((run(&one), folder.exists()), (1, false));
    let unit = one.videos(&[]).unwrap()[0].units[0].clone();
    let recorded = || Record::read(&artifacts::dir(&work, StageName::Lift, &unit)).unwrap().fingerprint;
    assert!(recorded().settings["lift"].get("adapt").is_none() && recorded().inputs.len() == 4);

    let one = project(dir.path(), &["a.mp4"], "auto");
    assert_eq!(run(&one), 1);
    let bytes = || [&weights, &record_path(&folder)].map(|path| std::fs::read(path).unwrap());
    let first = bytes();
    assert!(recorded().inputs.contains_key("adapted body weights"));
    assert!(Record::read(&folder).unwrap().facts["reprojection_error_mm"]["before"].is_number());

    // Killed before the record was written.
    std::fs::remove_file(record_path(&folder)).unwrap();
    std::fs::write(&weights, "part of a file").unwrap();
    assert_eq!(run(&one), 0, "the lifts are up to date with the same weights");
    assert!(bytes() == first);

    let two = project(dir.path(), &["a.mp4", "b.mp4"], "auto");
    assert_eq!(run(&two), 1, "the new video only");
    assert!(bytes() == first);
}
