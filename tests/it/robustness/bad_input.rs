//! Invalid beside valid input: each problem is reported with its file and a remedy, rejected content is no failure,
//! other units continue, the exit code shows failures, and no existing output is lost.

use crate::fixtures::clips::ffmpeg;
use orator_base::types::pose2d::Keypoints;
use orator_formats::keypoints_npz;
use orator_onnx::{Manifest, ModelEntry};
use orator_test_support::project::{ProgramAnswer, Project, files_under};
use orator_test_support::skip::skip;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Line that `stage` reports for the video whose work name starts with `name`.
fn line(answer: &ProgramAnswer, stage: &str, name: &str) -> String {
    let find = |list: &str, text: &str| {
        let entries = answer.json[list].as_array().cloned().unwrap_or_default();
        let is_unit = |entry: &&Value| {
            let unit = entry["unit"].as_str().unwrap_or_default().replace("host/", "");
            entry["stage"] == stage && unit.starts_with(&format!("{name}-"))
        };
        entries.iter().find(is_unit).map(|entry| entry[text].as_str().unwrap_or_default().to_owned())
    };
    find("failures", "error").map(|error| format!("failed: {error}")).or(find("units", "line")).unwrap_or_default()
}

/// Copies `from` without read permission; returns false, with a skip line, if this user may read every file.
fn copy_unreadable(from: &Path, to: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    fs::copy(from, to).unwrap();
    fs::set_permissions(to, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::File::open(to).is_err() {
        return true;
    }
    skip("in part: this user (root?) may read files without read permission");
    fs::remove_file(to).unwrap();
    false
}

/// Writes `nobody.mp4`: a gray image with a tone.
fn write_gray_video(project: &Project, size: &str, secs: u32) {
    let inputs = format!("-f lavfi -i color=gray:size={size}:duration={secs}:rate=15 -f lavfi -i sine=duration={secs}");
    assert!(ffmpeg(&project.video(""), &format!("{inputs} nobody.mp4")));
}

/// Keypoints of the video whose work name starts with `name`.
fn keypoints(project: &Project, name: &str) -> Keypoints {
    let is_wanted =
        |(file, _): &(String, PathBuf)| file.contains(&format!("{name}-")) && file.ends_with("/keypoints.npz");
    let file = files_under(&project.work().join("pose2d")).into_iter().find(is_wanted);
    keypoints_npz::read(&file.expect(name).1).unwrap()
}

/// Asserts that two encodings of one clip have the same points, within a few px.
fn assert_alike(one: &Keypoints, other: &Keypoints) {
    assert_eq!((one.image_size, one.n_frames()), (other.image_size, other.n_frames()));
    let parts = [
        (&one.body, &other.body, 0.3),
        (&one.left_hand, &other.left_hand, 0.0),
        (&one.right_hand, &other.right_hand, 0.0),
    ];
    let (mut n_points, mut n_near, mut n_known) = (0, 0, 0);
    for (one, other, least_score) in parts {
        for (p, q) in one.rows().into_iter().zip(other.rows()) {
            n_points += 1;
            if p[2] > least_score && q[2] > least_score {
                n_known += 1;
                n_near += usize::from((p[0] - q[0]).hypot(p[1] - q[1]) < 3.0);
            }
        }
    }
    eprintln!("{n_near} of {n_known} points, of {n_points}, are within 3 px");
    assert!(n_known * 10 > n_points * 8 && n_near * 100 >= n_known * 98, "{n_near} of {n_known} of {n_points}");
}

#[test]
fn invalid_videos_are_reported_and_the_others_are_processed() {
    let project = Project::with_clips("bad", 1, 6.0);
    let good = project.clips().remove(0);
    let from = good.to_string_lossy().into_owned();
    let make = |name: &str, options: &str| {
        assert!(ffmpeg(&project.video(""), &format!("-i {from} {options} {name}")), "{name}");
    };
    fs::write(project.video("text.mp4"), "this is no video\n").unwrap();
    fs::write(project.video("zero.mp4"), "").unwrap();
    // The project's clips have their index first, so that half a file is half a clip; those of ffmpeg have it last.
    let half = |from: &Path, name: &str| {
        let bytes = fs::read(from).unwrap();
        fs::write(project.video(name), &bytes[..bytes.len() / 2]).unwrap();
    };
    half(&good, "damaged.mp4");
    make("../indexed-last.mp4", "-c copy");
    half(&project.video("../indexed-last.mp4"), "truncated.mp4");
    fs::create_dir(project.video("folder.mp4")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("nowhere.mp4", project.video("dangling.mp4")).unwrap();
    let locked = copy_unreadable(&good, &project.video("locked.mp4"));
    make("silent.mp4", "-an -c copy");
    make("oneframe.mp4", "-frames:v 1 -t 0.1");
    make("slow10fps.mp4", "-r 10");
    // Encoded rotated, with metadata that rotates it back.
    make("../coded.mp4", "-vf transpose=cclock");
    let rotate = "-i ../coded.mp4 -c copy -metadata:s:v rotate=270 rotated.mp4";
    assert!(ffmpeg(&project.video(""), rotate));
    write_gray_video(&project, "640x480", 6);
    project.name_videos(&["videos/host", "videos/missing.mp4", "videos/none-*.mp4", "videos/empty"]);
    fs::create_dir_all(project.video("../empty")).unwrap();

    let answer = project.run(&[]);
    assert_eq!(answer.code, 2, "{}", answer.errors);
    for (name, expected) in [
        ("text", "text.mp4"),
        ("zero", "zero.mp4"),
        ("truncated", "truncated.mp4"),
        ("folder", "folder.mp4"),
        ("missing", "missing.mp4"),
        ("dangling", "dangling.mp4"),
        ("locked", "locked.mp4"),
    ] {
        if name == "locked" && !locked {
            continue;
        }
        let error = line(&answer, "extract", name);
        assert!(error.starts_with("failed: ") && error.contains(expected), "{name}: {error:?}");
    }
    assert!(line(&answer, "extract", "damaged").contains("the file is damaged, its readable part is used"));
    for (name, expected) in [("silent", "sound"), ("nobody", "still"), ("oneframe", "no interval accepted")] {
        let reason = line(&answer, "segment", name);
        assert!(!reason.starts_with("failed") && reason.contains(expected), "{name}: {reason:?}");
    }
    for name in ["slow10fps", "rotated"] {
        let summary = line(&answer, "segment", name);
        assert!(summary.contains("accepted") && !summary.starts_with("accepted 0.0"), "{name}: {summary:?}");
    }
    assert_alike(&keypoints(&project, "rotated"), &keypoints(&project, "clip-1"));
    for message in ["none-*.mp4", "empty"] {
        assert!(answer.errors.contains(message), "{message}: {}", answer.errors);
    }
    let index = project.work().join("dataset/host/index.jsonl");
    let before = fs::read(&index).unwrap();
    let again = project.run(&[]);
    assert_eq!((again.code, fs::read(&index).unwrap()), (2, before));
    assert_eq!(again.json["stages"]["pose2d"]["done"], 0, "an up-to-date unit was processed again");
}

#[test]
fn a_speaker_without_an_interval_exits_with_2_and_the_reasons() {
    let project = Project::with_clips("nothing", 0, 0.0);
    write_gray_video(&project, "320x240", 5);
    let answer = project.run(&[]);
    assert_eq!(answer.code, 2);
    assert!(answer.errors.contains("no interval") && answer.errors.contains("still"), "{}", answer.errors);
}

#[test]
fn invalid_settings_exit_with_1_and_a_remedy() {
    let project = Project::with_clips("set-up", 1, 2.0);
    let fails = |args: &[&str], expected: &[&str]| {
        let answer = project.run(args);
        assert_eq!(answer.code, 1, "{args:?}: {}", answer.errors);
        for text in expected {
            assert!(answer.errors.contains(text), "{args:?}: {text:?} is not in {:?}", answer.errors);
        }
    };
    fails(&["--set", "models.dir=nowhere"], &["marker", "nowhere", "models fetch"]);
    fs::write(project.dir().join("file"), "").unwrap();
    fails(
        &["--set", &format!("work.dir={}", project.dir().join("file/work").display())],
        &["cannot write", "work.dir"],
    );
    fails(&["--set", "extract.fps=0"], &["extract.fps", "1 to 120"]);
    fails(&["--set", "pose2d.body=no-such-model"], &["no-such-model", "models add"]);
    fails(&["--speaker", "nobody"], &["nobody", "host"]);
    fails(&["--from", "lift", "--to", "extract"], &["--from"]);
    fails(&["--what"], &["--what"]);
    fails(&["-c", "gone.toml"], &["gone.toml", "orator init"]);
    let file = project.dir().join("pipeline.toml");
    fs::write(&file, "[extract]\nfsp = 15\nfps = \"a\"\n").unwrap();
    fails(&[], &["2 problems", "line 2: extract.fsp", "did you mean fps", "line 3: extract.fps"]);
}

#[test]
fn invalid_models_exit_with_1_and_name_the_model_and_the_cause() {
    let project = Project::with_clips("models", 1, 1.0);
    let models = |folder: &str| {
        let to = project.dir().join(folder);
        fs::create_dir(&to).unwrap();
        for (name, path) in files_under(&project.dir().join("models")) {
            fs::copy(path, to.join(name)).unwrap();
        }
        to
    };
    let write_manifest = |folder: &str, id: &str, change: &dyn Fn(&mut ModelEntry)| {
        let mut entry = Manifest::builtin().unwrap().get(id).unwrap().clone();
        change(&mut entry);
        let manifest = Manifest { models: vec![entry], ..Manifest::default() };
        fs::write(models(folder).join("manifest.toml"), toml::to_string(&manifest).unwrap()).unwrap();
    };
    fs::remove_file(models("missing").join("marker_body.onnx")).unwrap();
    let flipped = models("flipped").join("marker_person.onnx");
    let mut bytes = fs::read(&flipped).unwrap();
    bytes[1000] ^= 1;
    fs::write(&flipped, bytes).unwrap();
    write_manifest("input", "person-marker", &|entry| entry.inputs[0].shape = vec![1, 3, 416, 416]);
    write_manifest("output", "body-marker", &|entry| entry.outputs[0].shape = vec![1, 17, 128, 96]);
    for (folder, expected) in [
        ("missing", ["body-marker is missing", "marker_body.onnx", "models fetch"]),
        ("flipped", ["person-marker differs from its description", "marker_person.onnx has sha256", "models add"]),
        ("input", ["tensors of the model person-marker differ", "416", "320"]),
        ("output", ["tensors of the model body-marker differ", "128", "64"]),
    ] {
        let answer = project.run(&["--set", &format!("models.dir={folder}")]);
        assert_eq!(answer.code, 1, "{folder}: {}", answer.errors);
        assert!(expected.iter().all(|text| answer.errors.contains(text)), "{folder}: {}", answer.errors);
    }
}

#[test]
fn after_a_failure_run_and_status_do_not_propose_each_other() {
    let project = Project::with_clips("circle", 0, 1.0);
    fs::write(project.video("broken.mp4"), "no film").unwrap();
    let run = project.run(&[]);
    assert_eq!((run.code, run.json["next"].as_str()), (2, Some("orator report")), "{}", run.errors);
    for (args, next) in [(&["status"][..], "orator status --why"), (&["status", "--why"], "orator report")] {
        assert_eq!(project.answer(args).json["next"], next);
    }
}
