//! A dataset made from keypoint files: the keypoints of the synthetic speaker, written in the format of OpenPose, give
//! nearly the joints of its video. Also the configuration keys that keypoint files require.

use crate::fixtures::media::foreign_keypoints as foreign;
use crate::fixtures::media::foreign_keypoints::OpenPoseOrder;
use orator::Dataset;
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_formats::{joints_npz, keypoints_npz};
use orator_pipeline::keypoints::convert;
use orator_test_support::project::Project;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const RATE: FrameRate = FrameRate::new(15, 1);

fn orator(dir: &Path, args: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.current_dir(dir).args(args).stdin(Stdio::null()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.code(), text)
}

/// Path of the only file of that name in the output folder of a stage.
fn stage_file(dir: &Path, stage: &str, name: &str) -> PathBuf {
    let speaker = dir.join("work").join(stage).join("host");
    let videos = std::fs::read_dir(&speaker).unwrap().map(|entry| entry.unwrap().path());
    let found: Vec<PathBuf> = videos.filter(|path| path.is_dir()).map(|path| path.join(name)).collect();
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].clone()
}

fn configure(dir: &Path, keys: &str) {
    let text = format!("[[speaker]]\nname = \"host\"\n{keys}\n[models]\ndir = \"none\"\nonnxruntime = \"none.so\"\n");
    std::fs::write(dir.join("pipeline.toml"), text).unwrap();
}

/// Mean distance of the joints that both motions have, mm.
fn mean_distance_mm(a: &Motion, b: &Motion) -> f64 {
    assert_eq!(a.joints.shape(), b.joints.shape());
    let pairs = a.joints.rows().into_iter().zip(b.joints.rows());
    let distances = pairs.map(|(a, b)| (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>().sqrt());
    let distances: Vec<f64> = distances.filter(|distance| distance.is_finite()).collect();
    assert!(distances.len() > a.joints.len() / 6, "{} distances", distances.len());
    1000.0 * distances.iter().sum::<f64>() / distances.len() as f64
}

#[test]
fn keypoint_files_give_nearly_the_joints_of_their_video() {
    let project = Project::with_clips("keypoints", 1, 8.0);
    let ran = project.run(&[]);
    assert_eq!(ran.code, 0, "{}", ran.errors);
    let from_video = joints_npz::read(&stage_file(project.dir(), "lift", "joints.npz")).unwrap();
    let keypoints = keypoints_npz::read(&stage_file(project.dir(), "pose2d", "keypoints.npz")).unwrap();

    let dir = tempfile::tempdir().unwrap();
    let audio = dir.path().join("sound");
    std::fs::create_dir(&audio).unwrap();
    std::fs::copy(stage_file(project.dir(), "extract", "audio.wav"), audio.join("clip.wav")).unwrap();
    foreign::openpose(&dir.path().join("kp/clip"), &keypoints, OpenPoseOrder::Body25);
    let size = format!("{}x{}", keypoints.image_size[0], keypoints.image_size[1]);
    configure(dir.path(), &format!("keypoints = \"kp\"\naudio = \"sound\"\nfps = 15\nsize = \"{size}\""));
    let (code, text) = orator(dir.path(), &["run"]);
    assert_eq!(code, Some(0), "{text}");
    let joints = joints_npz::read(&stage_file(dir.path(), "lift", "joints.npz")).unwrap();
    let mm = mean_distance_mm(&from_video, &joints);
    eprintln!("{mm:.3} mm between the two sets of joints at the same rate");
    assert!(mm < 1.0, "{mm} mm");

    // Status, report and card list the checks that keypoint files do not allow; the dataset lists no model.
    let (_, status) = orator(dir.path(), &["status"]);
    let unchecked = "cuts, static images and printed or on-screen persons are not checked";
    assert!(status.contains("OpenPose, 25 points at 15 fps") && status.contains(unchecked), "{status}");
    let dataset = dir.path().join("work/dataset/host");
    let card = std::fs::read_to_string(dataset.join("README.md")).unwrap();
    assert!(card.contains("1 video made from keypoints (OpenPose, 25 points at 15 fps)"), "{card}");
    assert!(card.contains(unchecked) && !card.contains("with the models"), "{card}");
    assert!(Dataset::open(&dataset).unwrap().info().models.is_empty());
    let (code, text) = orator(dir.path(), &["dataset", "verify", "work/dataset/host"]);
    assert_eq!(code, Some(0), "{text}");
    let page = dir.path().join("report.html");
    let (code, text) = orator(dir.path(), &["report", "--out", &page.to_string_lossy()]);
    assert_eq!(code, Some(0), "{text}");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains(unchecked) && !page.contains("No pictures available"));

    // A second run does no work; a changed frame counts as a changed video.
    let (_, again) = orator(dir.path(), &["run", "--to", "lift"]);
    assert!(!again.contains("frames at 15 fps"), "{again}");
    let frame = dir.path().join("kp/clip/clip_000000000060_keypoints.json");
    std::fs::write(frame, "{\"version\": 1.3, \"people\": []}").unwrap();
    let (_, changed) = orator(dir.path(), &["status", "--why"]);
    assert!(changed.contains("the video changed"), "{changed}");

    // Resampled to twice the rate and back, the joints differ by no more than the interpolation error.
    let found = orator_formats::keypoints::read(&dir.path().join("kp/clip")).unwrap();
    let twice = convert(found, RATE, keypoints.image_size, FrameRate::new(30, 1)).unwrap().keypoints;
    foreign::openpose(&dir.path().join("fast/clip"), &twice, OpenPoseOrder::Coco18);
    configure(dir.path(), &format!("keypoints = [\"fast\"]\naudio = [\"sound/*.wav\"]\nfps = 30\nsize = \"{size}\""));
    let (code, text) = orator(dir.path(), &["run", "--to", "lift", "--set", "work.dir=fast_work"]);
    assert_eq!(code, Some(0), "{text}");
    std::fs::rename(dir.path().join("work"), dir.path().join("first_work")).unwrap();
    std::fs::rename(dir.path().join("fast_work"), dir.path().join("work")).unwrap();
    let joints = joints_npz::read(&stage_file(dir.path(), "lift", "joints.npz")).unwrap();
    let mm = mean_distance_mm(&from_video, &joints);
    eprintln!("{mm:.3} mm between the two sets of joints after resampling to twice the rate");
    assert!(mm < 5.0, "{mm} mm");
}

#[test]
fn errors_name_the_configuration_key_of_a_missing_value() {
    let dir = tempfile::tempdir().unwrap();
    foreign::openpose(&dir.path().join("kp/clip"), &foreign::sample(30, RATE), OpenPoseOrder::Body25);
    std::fs::write(dir.path().join("other.wav"), "").unwrap();
    for (keys, expected) in [
        (
            "keypoints = \"kp\"",
            "kp/clip: keypoint files contain no audio: add `audio = [\"FOLDER\"]` beside `keypoints`",
        ),
        ("keypoints = \"kp\"\naudio = \"none\"", "cannot hash the sound: cannot read"),
        ("keypoints = [\"kp\", \"none/*.npz\"]\naudio = \"other.wav\"", "none/*.npz: no matching file"),
        (
            "keypoints = \"kp\"\naudio = \"other.wav\"",
            "kp/clip does not state its frame rate: set it beside `keypoints` in [[speaker]], for example `fps = 25`",
        ),
        (
            "keypoints = \"kp\"\naudio = \"other.wav\"\nfps = 15",
            "kp/clip does not state its image size: set it beside `keypoints` in [[speaker]], for example `size = \"1280x720\"`",
        ),
        (
            "keypoints = \"kp\"\nfps = 2000",
            "speaker[0].fps: invalid frame rate 2000: expected 1 to 1000 frames per second",
        ),
        (
            "keypoints = \"kp\"\nsize = \"wide\"",
            "speaker[0].size: invalid size \"wide\": expected width and height in pixels",
        ),
        ("fps = 15", "speaker[0]: the key videos is missing"),
        ("keypoints = []", "speaker[0].videos: no video is listed"),
    ] {
        configure(dir.path(), keys);
        let (code, text) = orator(dir.path(), &["run", "--to", "lift"]);
        assert!(code.is_some_and(|code| code != 0) && text.contains(expected), "{keys}: {text}");
    }
}
