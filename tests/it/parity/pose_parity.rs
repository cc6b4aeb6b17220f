//! The 2D chain gives the keypoints of the Python reference on real clips, on the frames that the reference used and
//! with its person detector. Needs `ORATOR_DATA` and a Python with onnxruntime and cv2 (ORATOR_REFERENCE_PYTHON).

use crate::fixtures::onnx_models::models;
use orator_base::types::pose2d::{Keypoint, Pose2d};
use orator_dataset::config;
use orator_formats::keypoints_npz;
use orator_formats::npz::Npz;
use orator_media::ffmpeg::frames::FrameReader;
use orator_pipeline::pose2d::Chain;
use orator_test_support::skip::{python, real_data};
use std::path::{Path, PathBuf};
use std::process::Command;

const MAX_BODY_PX: f32 = 1.5;
const MAX_HAND_PX: f32 = 2.0;
/// Smallest score, in both results, of the body keypoints that are compared.
const MIN_SCORE: f32 = 0.3;
/// Smallest share of frames in which both detect a hand, or neither does.
const MIN_AGREEMENT: f64 = 0.95;

/// Path of a copy of the first `secs` of a real clip.
#[track_caller]
fn clip(name: &str, secs: u32, dir: &Path) -> Option<PathBuf> {
    let source = real_data(&format!("data/videos/{name}"))?;
    let cut = dir.join("clip.mp4");
    let command = ["-v", "error", "-y", "-t", &secs.to_string(), "-i"].map(str::to_owned);
    let done = Command::new("ffmpeg").args(command).arg(&source).args(["-c:v", "copy", "-an"]).arg(&cut).status();
    assert!(done.unwrap().success());
    Some(cut)
}

fn median(mut values: Vec<f32>) -> f32 {
    assert!(!values.is_empty(), "no values to compare");
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

#[track_caller]
fn compare(name: &str, secs: u32) {
    let (Some((store, runtime)), Some(models), Some(python)) =
        (models(), real_data("models"), python("onnxruntime, cv2, numpy"))
    else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let Some(clip) = clip(name, secs, dir.path()) else { return };
    let Some(script) = real_data("reference/pose_chain_reference.py") else { return };
    let reference_file = dir.path().join("reference.npz");
    let mut command = Command::new(python);
    command.arg(script).arg(&clip).arg(&reference_file).env("MODELS", &models).env("OMP_NUM_THREADS", "1");
    assert!(command.status().unwrap().success());
    let reference = keypoints_npz::read(&reference_file).unwrap();
    let times = Npz::open(&reference_file).unwrap().numbers("time_secs", &[None]).unwrap();

    // The reference detects the person in every 15th frame.
    let settings = config::Pose2dConfig {
        person: "person-yolox-nano".into(),
        person_every: 15,
        ..config::Pose2dConfig::default()
    };
    let mut chain = Chain::new(&runtime, &store, &settings).unwrap();
    let rate = FrameReader::open(&clip, orator_base::types::time::FrameRate::new(1, 1)).unwrap();
    let rate = rate.info().video.as_ref().and_then(|video| video.fps).unwrap();
    let frame_indices: Vec<usize> = times.iter().map(|secs| (secs * rate.per_sec()).round() as usize).collect();
    let frames = FrameReader::open(&clip, rate).unwrap().map(Result::unwrap);
    let chosen = frames.filter(|frame| frame_indices.contains(&frame.frame_idx));
    let poses: Vec<Pose2d> = chosen.map(|frame| chain.frame(&frame.image).unwrap()).collect();
    assert_eq!(poses.len(), reference.n_frames());

    let at = |array: &ndarray::Array3<f32>, t: usize, k: usize| [0, 1, 2].map(|part| array[[t, k, part]]);
    let distance = |own: &Keypoint, expected: [f32; 3]| (own.x - expected[0]).hypot(own.y - expected[1]);
    let (mut body, mut hands) = (Vec::new(), Vec::new());
    let (mut n_agree, mut n_both) = (0, 0);
    for (t, pose) in poses.iter().enumerate() {
        for (k, own) in pose.body.iter().enumerate() {
            let expected = at(&reference.body, t, k);
            if own.score.min(expected[2]) >= MIN_SCORE {
                body.push(distance(own, expected));
            }
        }
        for (own, expected) in [(&pose.left_hand, &reference.left_hand), (&pose.right_hand, &reference.right_hand)] {
            let (found, in_reference) = (own[0].score > 0.0, expected[[t, 0, 2]] > 0.0);
            n_agree += usize::from(found == in_reference);
            n_both += usize::from(found && in_reference);
            if found && in_reference {
                hands.extend(own.iter().enumerate().map(|(k, own)| distance(own, at(expected, t, k))));
            }
        }
    }
    let agreement = n_agree as f64 / (2 * poses.len()) as f64;
    let (body, hands) = (median(body), median(hands));
    eprintln!(
        "{name}: {} frames, median body {body:.3} px, hands {hands:.3} px (both detected {n_both} times, agreement {:.1} %)",
        poses.len(),
        100.0 * agreement
    );
    assert!(body <= MAX_BODY_PX && hands <= MAX_HAND_PX && agreement >= MIN_AGREEMENT);
}

#[test]
fn keypoints_agree_with_the_reference_on_a_seated_speaker() {
    compare("talk_tyson_2cam_17s_720p.mp4", 3);
}

#[test]
fn keypoints_agree_with_the_reference_at_1080p() {
    compare("talk_oliver_wan_3.5s_1080p.mp4", 3);
}
