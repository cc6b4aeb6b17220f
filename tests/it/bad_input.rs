//! Bad input in one folder with good: each is reported with its file and what to do, refused content is no failure,
//! the others go on, the exit code tells, and nothing made is lost.

use crate::support::{Answer, Project, ffmpeg};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The line of `stage` for the video whose work name begins with `name`.
fn line(answer: &Answer, stage: &str, name: &str) -> String {
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

#[test]
fn bad_videos_are_reported_and_the_others_go_on() {
    let project = Project::with_clips("bad", 1, 6.0);
    let good = project.clips().remove(0);
    let from = good.to_string_lossy().into_owned();
    let make = |name: &str, options: &[&str]| ffmpeg(&[&["-i", &from], options].concat(), &project.video(name));
    fs::write(project.video("text.mp4"), "this is no video\n").unwrap();
    fs::write(project.video("zero.mp4"), "").unwrap();
    // The program's own files have their index in front, so that half a file is half a clip; ffmpeg's end with it.
    let half = |from: &Path, name: &str| {
        let bytes = fs::read(from).unwrap();
        fs::write(project.video(name), &bytes[..bytes.len() / 2]).unwrap();
    };
    half(&good, "damaged.mp4");
    let indexed_last = project.dir().join("indexed-last.mp4");
    ffmpeg(&["-i", &from, "-c", "copy"], &indexed_last);
    half(&indexed_last, "truncated.mp4");
    fs::create_dir(project.video("folder.mp4")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("nowhere.mp4", project.video("dangling.mp4")).unwrap();
    make("silent.mp4", &["-an", "-c", "copy"]);
    make("oneframe.mp4", &["-frames:v", "1", "-t", "0.1"]);
    make("slow10fps.mp4", &["-r", "10"]);
    make("rotated.mp4", &["-vf", "transpose=2", "-metadata:s:v", "rotate=270"]);
    ffmpeg(
        &["-f", "lavfi", "-i", "color=gray:size=640x480:duration=6:rate=15", "-f", "lavfi", "-i", "sine=duration=6"],
        &project.video("nobody.mp4"),
    );
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
    ] {
        let error = line(&answer, "extract", name);
        assert!(error.starts_with("failed: ") && error.contains(says), "{name}: {error:?}");
    }
    assert!(line(&answer, "extract", "damaged").contains("damaged, what could be read is kept"));
    for (name, says) in [("silent", "sound"), ("nobody", "person"), ("oneframe", "nothing kept")] {
        let refusal = line(&answer, "segment", name);
        assert!(!refusal.starts_with("failed") && refusal.contains(says), "{name}: {refusal:?}");
    }
    for name in ["slow10fps", "rotated"] {
        let kept = line(&answer, "segment", name);
        assert!(kept.contains("kept") && !kept.starts_with("kept 0.0"), "{name}: {kept:?}");
    }
    for message in ["none-*.mp4", "empty"] {
        assert!(answer.errors.contains(message), "{message}: {}", answer.errors);
    }
    let shard = project.work().join("dataset/host/index.json");
    let made = fs::read(&shard).unwrap();
    let again = project.run(&[]);
    assert_eq!((again.code, fs::read(&shard).unwrap()), (2, made));
    assert_eq!(again.json["stages"]["pose2d"]["done"], 0, "fresh work was done again");
}

#[test]
fn a_speaker_without_an_interval_is_exit_code_2_with_the_reasons() {
    let project = Project::with_clips("nothing", 0, 0.0);
    ffmpeg(
        &["-f", "lavfi", "-i", "color=gray:size=320x240:duration=5:rate=15", "-f", "lavfi", "-i", "sine=duration=5"],
        &project.video("nobody.mp4"),
    );
    let answer = project.run(&[]);
    assert_eq!(answer.code, 2);
    assert!(answer.errors.contains("no interval") && answer.errors.contains("person"), "{}", answer.errors);
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
