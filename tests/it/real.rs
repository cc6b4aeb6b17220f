//! Real clips through the real models, where ../shared is there: a speaker without visible hands is refused with that
//! reason, one of two people is followed, HEVC works.

use crate::clips::ffmpeg;
use crate::support::{Project, files_under, shared};
use orator::motion::keypoints_npz;
use std::path::Path;

/// A project on the real models with the clips given.
fn project(name: &str, models: &Path, clips: &[&Path]) -> Project {
    let project = Project::with_clips(name, 0, 0.0);
    let videos: Vec<String> = clips.iter().map(|clip| clip.to_string_lossy().into_owned()).collect();
    let text = format!("[models]\ndir = {models:?}\n[[speaker]]\nname = \"host\"\nvideos = {videos:?}\n");
    std::fs::write(project.dir().join("pipeline.toml"), text).unwrap();
    project
}

#[test]
fn hands_never_visible_is_a_refusal_not_a_failure() {
    let (Some(clip), Some(models)) = (shared("data/videos/talk_kim_7s_1080p.mp4"), shared("models")) else { return };
    let project = project("kim", &models, &[&clip]);
    let answer = project.run(&["--to", "segment"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let line = answer.json["units"].to_string();
    assert!(line.contains("hands"), "{line}");
    let answer = project.run(&[]);
    assert_eq!(answer.code, 2, "a speaker without an interval");
    assert!(answer.errors.contains("hands"), "{}", answer.errors);
}

#[test]
fn one_of_two_people_is_followed() {
    let (Some(videos), Some(models)) = (shared("data/videos"), shared("models")) else { return };
    let (tyson, oliver) = ("talk_tyson_2cam_17s_720p.mp4", "talk_latentsync_demo1_1080x1920_hevc.mp4");
    if [tyson, oliver].iter().any(|name| shared(&format!("data/videos/{name}")).is_none()) {
        return;
    }
    let project = project("two", &models, &[Path::new("videos/host/two.mp4"), &videos.join(oliver)]);
    let filter = "[0:v]fps=25,scale=-2:480,trim=0:5[a];[1:v]fps=25,scale=-2:480,trim=0:5[b];[a][b]hstack";
    let out = project.video("two.mp4");
    let mix = format!("-i {tyson} -i {oliver} -filter_complex {filter} -map 0:a -t 5 {}", out.display());
    assert!(ffmpeg(&videos, &mix));
    let answer = project.run(&["--to", "segment"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let units = answer.json["units"].as_array().unwrap();
    let pose =
        units.iter().find(|unit| unit["stage"] == "pose2d" && unit["unit"].to_string().contains("two-")).unwrap();
    eprintln!("{pose}");
    assert!(pose["facts"]["several_people"].as_f64().unwrap_or_default() > 0.9, "{pose}");
    let kept = |name: &str| {
        let is_it = |unit: &&serde_json::Value| unit["stage"] == "segment" && unit["unit"].to_string().contains(name);
        units.iter().find(is_it).map(|unit| unit["line"].to_string()).unwrap_or_default()
    };
    assert!(
        kept("two-").contains("kept") && kept("latentsync").contains("kept"),
        "{} {}",
        kept("two-"),
        kept("latentsync")
    );

    let work = project.work();
    let made = |stage: &str, file: &str| {
        let files = files_under(&work.join(stage)).into_iter();
        files
            .map(|(name, path)| (name.contains("two-") && name.ends_with(file), path))
            .find(|(is_it, _)| *is_it)
            .unwrap()
            .1
    };
    let extras = keypoints_npz::read_extras(&made("pose2d", "keypoints.npz")).unwrap();
    // The first of the two pictures, 853 or 854 px wide, ends where the second begins. Neither has a cut in these 5 s.
    let n_frames = extras.person.nrows();
    let n_left = extras.person.outer_iter().filter(|person| person[0] + person[2] / 2.0 < 853.5).count();
    eprintln!("the followed person is on the left in {n_left} of {n_frames} frames; {}", kept("two-"));
    assert!(n_frames >= 70 && (n_left == 0 || n_left == n_frames), "{n_left} of {n_frames} frames on the left");
}
