//! From keypoints of another program to a dataset: the synthetic speaker's own keypoints, written as OpenPose writes them,
//! give nearly the joints that its video gave. And what the configuration must say beside them.

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

/// The one file of that name under the folder of a stage.
fn made(dir: &Path, stage: &str, name: &str) -> PathBuf {
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

/// Mean distance of joints that both have, mm.
fn apart_mm(a: &Motion, b: &Motion) -> f64 {
    assert_eq!(a.joints.shape(), b.joints.shape());
    let pairs = a.joints.rows().into_iter().zip(b.joints.rows());
    let far = pairs.map(|(a, b)| (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>().sqrt());
    let far: Vec<f64> = far.filter(|distance| distance.is_finite()).collect();
    assert!(far.len() > a.joints.len() / 6, "{} distances", far.len());
    1000.0 * far.iter().sum::<f64>() / far.len() as f64
}

#[test]
fn keypoints_lead_to_nearly_the_joints_of_their_video() {
    let project = Project::with_clips("keypoints", 1, 8.0);
    let ran = project.run(&[]);
    assert_eq!(ran.code, 0, "{}", ran.errors);
    let of_video = joints_npz::read(&made(project.dir(), "lift", "joints.npz")).unwrap();
    let keypoints = keypoints_npz::read(&made(project.dir(), "pose2d", "keypoints.npz")).unwrap();

    let dir = tempfile::tempdir().unwrap();
    let sound = dir.path().join("sound");
    std::fs::create_dir(&sound).unwrap();
    std::fs::copy(made(project.dir(), "extract", "audio.wav"), sound.join("clip.wav")).unwrap();
    foreign::openpose(&dir.path().join("kp/clip"), &keypoints, OpenPoseOrder::Body25);
    let size = format!("{}x{}", keypoints.image_size[0], keypoints.image_size[1]);
    configure(dir.path(), &format!("keypoints = \"kp\"\naudio = \"sound\"\nfps = 15\nsize = \"{size}\""));
    let (code, text) = orator(dir.path(), &["run"]);
    assert_eq!(code, Some(0), "{text}");
    let joints = joints_npz::read(&made(dir.path(), "lift", "joints.npz")).unwrap();
    let mm = apart_mm(&of_video, &joints);
    eprintln!("{mm:.3} mm between the roads at the same rate");
    assert!(mm < 1.0, "{mm} mm");

    // Status, report and card say what was not judged; the dataset names no model.
    let (_, status) = orator(dir.path(), &["status"]);
    let not_judged = "cuts, static images and printed or on-screen persons are not checked";
    assert!(status.contains("OpenPose, 25 points at 15 fps") && status.contains(not_judged), "{status}");
    let dataset = dir.path().join("work/dataset/host");
    let card = std::fs::read_to_string(dataset.join("README.md")).unwrap();
    assert!(card.contains("1 video made from keypoints (OpenPose, 25 points at 15 fps)"), "{card}");
    assert!(card.contains(not_judged) && !card.contains("with the models"), "{card}");
    assert!(Dataset::open(&dataset).unwrap().info().models.is_empty());
    let (code, text) = orator(dir.path(), &["dataset", "verify", "work/dataset/host"]);
    assert_eq!(code, Some(0), "{text}");
    let page = dir.path().join("report.html");
    let (code, text) = orator(dir.path(), &["report", "--out", &page.to_string_lossy()]);
    assert_eq!(code, Some(0), "{text}");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains(not_judged) && !page.contains("No pictures available"));

    // Nothing is done again; another frame is another video.
    let (_, again) = orator(dir.path(), &["run", "--to", "lift"]);
    assert!(!again.contains("frames at 15 fps"), "{again}");
    let frame = dir.path().join("kp/clip/clip_000000000060_keypoints.json");
    std::fs::write(frame, "{\"version\": 1.3, \"people\": []}").unwrap();
    let (_, changed) = orator(dir.path(), &["status", "--why"]);
    assert!(changed.contains("the video changed"), "{changed}");

    // Twice the rate on the way and back again: the same within what lies between two frames.
    let found = orator_formats::keypoints::read(&dir.path().join("kp/clip")).unwrap();
    let twice = convert(found, RATE, keypoints.image_size, FrameRate::new(30, 1)).unwrap().keypoints;
    foreign::openpose(&dir.path().join("fast/clip"), &twice, OpenPoseOrder::Coco18);
    configure(dir.path(), &format!("keypoints = [\"fast\"]\naudio = [\"sound/*.wav\"]\nfps = 30\nsize = \"{size}\""));
    let (code, text) = orator(dir.path(), &["run", "--to", "lift", "--set", "work.dir=fast_work"]);
    assert_eq!(code, Some(0), "{text}");
    std::fs::rename(dir.path().join("work"), dir.path().join("first_work")).unwrap();
    std::fs::rename(dir.path().join("fast_work"), dir.path().join("work")).unwrap();
    let joints = joints_npz::read(&made(dir.path(), "lift", "joints.npz")).unwrap();
    let mm = apart_mm(&of_video, &joints);
    eprintln!("{mm:.3} mm between the roads over twice the rate");
    assert!(mm < 5.0, "{mm} mm");
}

#[test]
fn what_the_files_do_not_say_is_asked_for_by_its_key() {
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
            "kp/clip states no frame rate: set it next to `keypoints`, for example `fps = 25`",
        ),
        (
            "keypoints = \"kp\"\naudio = \"other.wav\"\nfps = 15",
            "kp/clip states no picture size: set it next to `keypoints`, for example `size = \"1280x720\"`",
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
