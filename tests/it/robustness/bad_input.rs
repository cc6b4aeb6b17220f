//! Bad input in one folder with good: each is reported with its file and what to do, refused content is no failure,
//! the others go on, the exit code tells, and nothing made is lost.

use crate::fixtures::clips::ffmpeg;
use orator_base::types::pose2d::Keypoints;
use orator_formats::keypoints_npz;
use orator_onnx::{Manifest, ModelEntry};
use orator_test_support::project::{ProgramAnswer, Project, files_under};
use orator_test_support::skip::skip;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// The line of `stage` for the video whose work name begins with `name`.
fn line(answer: &ProgramAnswer, stage: &str, name: &str) -> String {
    let of = |list: &str, text: &str| {
        let entries = answer.json[list].as_array().cloned().unwrap_or_default();
        let is_it = |entry: &&Value| {
            let unit = entry["unit"].as_str().unwrap_or_default().replace("host/", "");
            entry["stage"] == stage && unit.starts_with(&format!("{name}-"))
        };
        entries.iter().find(is_it).map(|entry| entry[text].as_str().unwrap_or_default().to_owned())
    };
    of("failures", "error").map(|error| format!("failed: {error}")).or(of("units", "line")).unwrap_or_default()
}

/// A copy of `from` that may not be read; false, with a loud line, for a user who may read everything.
fn lock(from: &Path, to: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    fs::copy(from, to).unwrap();
    fs::set_permissions(to, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::File::open(to).is_err() {
        return true;
    }
    skip("in part: this user (root?) may read a file without permission to read it");
    fs::remove_file(to).unwrap();
    false
}

/// `nobody.mp4`: a gray picture with a tone.
fn gray(project: &Project, size: &str, secs: u32) {
    let inputs = format!("-f lavfi -i color=gray:size={size}:duration={secs}:rate=15 -f lavfi -i sine=duration={secs}");
    assert!(ffmpeg(&project.video(""), &format!("{inputs} nobody.mp4")));
}

/// The keypoints made of the video whose work name begins with `name`.
fn keypoints(project: &Project, name: &str) -> Keypoints {
    let is_it = |(file, _): &(String, PathBuf)| file.contains(&format!("{name}-")) && file.ends_with("/keypoints.npz");
    let file = files_under(&project.work().join("pose2d")).into_iter().find(is_it);
    keypoints_npz::read(&file.expect(name).1).unwrap()
}

/// One picture coded twice: equal points are found, within a few px.
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
fn bad_videos_are_reported_and_the_others_go_on() {
    let project = Project::with_clips("bad", 1, 6.0);
    let good = project.clips().remove(0);
    let from = good.to_string_lossy().into_owned();
    let make = |name: &str, options: &str| {
        assert!(ffmpeg(&project.video(""), &format!("-i {from} {options} {name}")), "{name}");
    };
    fs::write(project.video("text.mp4"), "this is no video\n").unwrap();
    fs::write(project.video("zero.mp4"), "").unwrap();
    // The program's own files have their index in front, so that half a file is half a clip; ffmpeg's end with it.
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
    let locked = lock(&good, &project.video("locked.mp4"));
    make("silent.mp4", "-an -c copy");
    make("oneframe.mp4", "-frames:v 1 -t 0.1");
    make("slow10fps.mp4", "-r 10");
    // Coded turned one way, marked to be shown turned back.
    make("../coded.mp4", "-vf transpose=cclock");
    let mark = "-i ../coded.mp4 -c copy -metadata:s:v rotate=270 rotated.mp4";
    assert!(ffmpeg(&project.video(""), mark));
    gray(&project, "640x480", 6);
    project.name_videos(&["videos/host", "videos/missing.mp4", "videos/none-*.mp4", "videos/empty"]);
    fs::create_dir_all(project.video("../empty")).unwrap();

    let answer = project.run(&[]);
    assert_eq!(answer.code, 2, "{}", answer.errors);
    for (name, says) in [
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
        assert!(error.starts_with("failed: ") && error.contains(says), "{name}: {error:?}");
    }
    assert!(line(&answer, "extract", "damaged").contains("the file is damaged, its readable part is used"));
    for (name, says) in [("silent", "sound"), ("nobody", "still"), ("oneframe", "no interval accepted")] {
        let refusal = line(&answer, "segment", name);
        assert!(!refusal.starts_with("failed") && refusal.contains(says), "{name}: {refusal:?}");
    }
    for name in ["slow10fps", "rotated"] {
        let kept = line(&answer, "segment", name);
        assert!(kept.contains("accepted") && !kept.starts_with("accepted 0.0"), "{name}: {kept:?}");
    }
    assert_alike(&keypoints(&project, "rotated"), &keypoints(&project, "clip-1"));
    for message in ["none-*.mp4", "empty"] {
        assert!(answer.errors.contains(message), "{message}: {}", answer.errors);
    }
    let shard = project.work().join("dataset/host/index.jsonl");
    let made = fs::read(&shard).unwrap();
    let again = project.run(&[]);
    assert_eq!((again.code, fs::read(&shard).unwrap()), (2, made));
    assert_eq!(again.json["stages"]["pose2d"]["done"], 0, "fresh work was done again");
}

#[test]
fn a_speaker_without_an_interval_is_exit_code_2_with_the_reasons() {
    let project = Project::with_clips("nothing", 0, 0.0);
    gray(&project, "320x240", 5);
    let answer = project.run(&[]);
    assert_eq!(answer.code, 2);
    assert!(answer.errors.contains("no interval") && answer.errors.contains("still"), "{}", answer.errors);
}

#[test]
fn wrong_set_up_is_exit_code_1_and_says_what_to_do() {
    let project = Project::with_clips("set-up", 1, 2.0);
    let says = |args: &[&str], expected: &[&str]| {
        let answer = project.run(args);
        assert_eq!(answer.code, 1, "{args:?}: {}", answer.errors);
        for text in expected {
            assert!(answer.errors.contains(text), "{args:?}: {text:?} is not in {:?}", answer.errors);
        }
    };
    says(&["--set", "models.dir=nowhere"], &["marker", "nowhere", "models fetch"]);
    fs::write(project.dir().join("file"), "").unwrap();
    says(&["--set", &format!("work.dir={}", project.dir().join("file/work").display())], &["cannot write", "work.dir"]);
    says(&["--set", "extract.fps=0"], &["extract.fps", "1 to 120"]);
    says(&["--set", "pose2d.body=no-such-model"], &["no-such-model", "models add"]);
    says(&["--speaker", "nobody"], &["nobody", "host"]);
    says(&["--from", "lift", "--to", "extract"], &["--from"]);
    says(&["--what"], &["--what"]);
    says(&["-c", "gone.toml"], &["gone.toml", "orator init"]);
    let file = project.dir().join("pipeline.toml");
    fs::write(&file, "[extract]\nfsp = 15\nfps = \"a\"\n").unwrap();
    says(&[], &["2 problems", "line 2: extract.fsp", "did you mean fps", "line 3: extract.fps"]);
}

#[test]
fn wrong_models_are_exit_code_1_and_say_which_and_why() {
    let project = Project::with_clips("models", 1, 1.0);
    let models = |folder: &str| {
        let to = project.dir().join(folder);
        fs::create_dir(&to).unwrap();
        for (name, path) in files_under(&project.dir().join("models")) {
            fs::copy(path, to.join(name)).unwrap();
        }
        to
    };
    let described = |folder: &str, id: &str, change: &dyn Fn(&mut ModelEntry)| {
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
    described("input", "person-marker", &|entry| entry.inputs[0].shape = vec![1, 3, 416, 416]);
    described("output", "body-marker", &|entry| entry.outputs[0].shape = vec![1, 17, 128, 96]);
    for (folder, says) in [
        ("missing", ["body-marker is missing", "marker_body.onnx", "models fetch"]),
        ("flipped", ["person-marker differs from its description", "marker_person.onnx has sha256", "models add"]),
        ("input", ["tensors of the model person-marker differ", "416", "320"]),
        ("output", ["tensors of the model body-marker differ", "128", "64"]),
    ] {
        let answer = project.run(&["--set", &format!("models.dir={folder}")]);
        assert_eq!(answer.code, 1, "{folder}: {}", answer.errors);
        assert!(says.iter().all(|text| answer.errors.contains(text)), "{folder}: {}", answer.errors);
    }
}
