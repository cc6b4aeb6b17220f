//! Real clips through the real models, where ../shared is there: a speaker without visible hands is refused with that
//! reason, one of two people is followed, HEVC works.

use crate::support::{Project, ffmpeg, shared};
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
    let Some(shared) = shared("data/videos/talk_kim_7s_1080p.mp4") else { return };
    let clip = shared.join("data/videos/talk_kim_7s_1080p.mp4");
    let project = project("kim", &shared.join("models"), &[&clip]);
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
    let Some(shared) = shared("data/videos/talk_tyson_2cam_17s_720p.mp4") else { return };
    let videos = shared.join("data/videos");
    let (tyson, oliver) =
        (videos.join("talk_tyson_2cam_17s_720p.mp4"), videos.join("talk_latentsync_demo1_1080x1920_hevc.mp4"));
    let project = project("two", &shared.join("models"), &[Path::new("videos/host/two.mp4"), &oliver]);
    let filter = "[0:v]fps=25,scale=-2:480,trim=0:5[a];[1:v]fps=25,scale=-2:480,trim=0:5[b];[a][b]hstack";
    let (tyson, oliver) = (tyson.to_string_lossy(), oliver.to_string_lossy());
    ffmpeg(
        &["-i", &tyson, "-i", &oliver, "-filter_complex", filter, "-map", "0:a", "-t", "5"],
        &project.video("two.mp4"),
    );
    let answer = project.run(&["--to", "segment"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let units = answer.json["units"].as_array().unwrap();
    let pose =
        units.iter().find(|unit| unit["stage"] == "pose2d" && unit["unit"].to_string().contains("two-")).unwrap();
    eprintln!("{pose}");
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
}
