//! Real clips of `ORATOR_DATA` with the real models: a speaker without visible hands is rejected with that reason, one
//! of two persons is tracked, HEVC works.

use crate::fixtures::clips::ffmpeg;
use orator_formats::keypoints_npz;
use orator_formats::keypoints_npz::Extras;
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::{fetched_models, real_data};
use std::path::Path;

/// Project with the real models and the given clips.
fn project(name: &str, models: &Path, clips: &[&Path]) -> Project {
    let project = Project::with_clips(name, 0, 0.0);
    let videos: Vec<String> = clips.iter().map(|clip| clip.to_string_lossy().into_owned()).collect();
    let text = format!("[models]\ndir = {models:?}\n[[speaker]]\nname = \"host\"\nvideos = {videos:?}\n");
    std::fs::write(project.dir().join("pipeline.toml"), text).unwrap();
    project
}

#[test]
fn a_speaker_without_visible_hands_is_rejected_without_a_failure() {
    let (Some(clip), Some(models)) = (real_data("data/videos/talk_kim_7s_1080p.mp4"), fetched_models()) else {
        return;
    };
    let project = project("kim", &models, &[&clip]);
    let answer = project.run(&["--to", "segment"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let line = answer.json["units"].to_string();
    assert!(line.contains("hands"), "{line}");
    let answer = project.run(&[]);
    assert_eq!(answer.code, 2, "a speaker without an interval");
    assert!(answer.errors.contains("hand not visible"), "{}", answer.errors);
}

#[test]
fn one_of_two_persons_is_tracked() {
    let (Some(videos), Some(models)) = (real_data("data/videos"), fetched_models()) else { return };
    let (tyson, oliver) = ("talk_tyson_2cam_17s_720p.mp4", "talk_latentsync_demo1_1080x1920_hevc.mp4");
    if [tyson, oliver].iter().any(|name| real_data(&format!("data/videos/{name}")).is_none()) {
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
    assert!(pose["facts"]["several_persons"].as_f64().unwrap_or_default() > 0.9, "{pose}");
    let segment_line = |name: &str| {
        let is_it = |unit: &&serde_json::Value| unit["stage"] == "segment" && unit["unit"].to_string().contains(name);
        units.iter().find(is_it).map(|unit| unit["line"].to_string()).unwrap_or_default()
    };
    assert!(
        segment_line("two-").contains("accepted") && segment_line("latentsync").contains("accepted"),
        "{} {}",
        segment_line("two-"),
        segment_line("latentsync")
    );

    let work = project.work();
    let output_file = |stage: &str, file: &str| {
        let files = files_under(&work.join(stage)).into_iter();
        files
            .map(|(name, path)| (name.contains("two-") && name.ends_with(file), path))
            .find(|(is_it, _)| *is_it)
            .unwrap()
            .1
    };
    let extras = keypoints_npz::read_extras(&output_file("pose2d", "keypoints.npz")).unwrap();
    // The left video is 853 or 854 px wide, and the right one follows it. Neither has a cut in these 5 s.
    let n_frames = extras.person.nrows();
    let n_left = extras.person.outer_iter().filter(|person| person[0] + person[2] / 2.0 < 853.5).count();
    eprintln!("the tracked person is on the left in {n_left} of {n_frames} frames; {}", segment_line("two-"));
    assert!(n_frames >= 70 && (n_left == 0 || n_left == n_frames), "{n_left} of {n_frames} frames on the left");
}

/// Output of pose2d for a video composed of two real clips by a filter graph with the output `[v]`.
fn tracked(name: &str, inputs: &str, graph: &str) -> Option<Extras> {
    let (videos, models) = (real_data("data/videos")?, fetched_models()?);
    let project = project(name, &models, &[Path::new("videos/host/film.mp4")]);
    if name == "reference" {
        let picture = project.dir().join("speaker.png");
        assert!(ffmpeg(&videos, &format!("{LARGE} -frames:v 1 {}", picture.display())));
        let file = project.dir().join("pipeline.toml");
        let text = std::fs::read_to_string(&file).unwrap() + "reference = \"speaker.png\"\n";
        std::fs::write(&file, text).unwrap();
    }
    let out = project.video("film.mp4");
    let coding = "-c:v libx264 -preset veryfast -crf 20 -pix_fmt yuv420p -an";
    if !ffmpeg(&videos, &format!("{inputs} -filter_complex {graph} -map [v] {coding} {}", out.display())) {
        return None;
    }
    let answer = project.run(&["--to", "pose2d"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let files = files_under(&project.work().join("pose2d"));
    let (_, path) = files.into_iter().find(|(name, _)| name.ends_with("keypoints.npz")).unwrap();
    Some(keypoints_npz::read_extras(&path).unwrap())
}

/// Horizontal centre of the tracked bounding box in each frame, px.
fn centres(extras: &Extras) -> Vec<f32> {
    extras.person.outer_iter().map(|person| person[0] + person[2] / 2.0).collect()
}

const TYSON: &str = "-ss 1 -t 4 -i talk_tyson_2cam_17s_720p.mp4";
const LARGE: &str = "-ss 2 -t 4 -i talk_latentsync_demo1_1080x1920_hevc.mp4";

#[test]
fn a_person_is_tracked_instead_of_a_larger_static_image_of_one() {
    let graph = "[0:v]fps=15,scale=480:270,pad=640:720:80:225[a];\
                 [1:v]fps=15,select=eq(n\\,0),loop=-1:1,setpts=N/15/TB,scale=-2:720,crop=400:720,trim=0:4[b];\
                 [a][b]hstack,noise=alls=6:allf=t[v]";
    let Some(extras) = tracked("still", &format!("{TYSON} {LARGE}"), graph) else { return };
    let centres = centres(&extras);
    let changes = (1..centres.len()).filter(|&t| extras.identity[t] != extras.identity[t - 1]).collect::<Vec<_>>();
    eprintln!("the person is tracked from frame {changes:?} on");
    assert!(changes.len() == 1 && changes[0] <= 30, "{changes:?}");
    assert!(centres[changes[0]..].iter().all(|x| *x < 640.0), "{centres:?}");
}

#[test]
fn a_small_inset_video_is_not_tracked() {
    let graph = "[0:v]fps=15,scale=1280:720[a];[1:v]fps=15,scale=200:-2[b];[a][b]overlay=1040:20[v]";
    let Some(extras) = tracked("inset", &format!("{TYSON} {LARGE}"), graph) else { return };
    assert!(centres(&extras).iter().all(|x| (400.0..900.0).contains(x)));
    assert!(extras.identity.iter().all(|identity| *identity == 0), "{}", extras.identity);
}

#[test]
fn two_persons_who_swap_positions_are_distinguished() {
    let graph = "[0:v]fps=15,scale=-2:720,crop=560:720[a];[1:v]fps=15,scale=560:-2,crop=560:720:0:200[b];\
                 color=0x808080:s=1280x720:r=15:d=4[c];\
                 [c][a]overlay=x=min(700\\,max(20\\,20+(t-1.5)*600)):y=0[d];\
                 [d][b]overlay=x=max(20\\,min(700\\,700-(t-1.5)*600)):y=0[v]";
    let Some(extras) = tracked("swap", &format!("{TYSON} {LARGE}"), graph) else { return };
    let centres = centres(&extras);
    let last = centres.len() - 1;
    // The tracked person is on the left before the swap and on the right after it.
    let swapped = (centres[0] < 640.0) == (centres[last] < 640.0);
    eprintln!("from {} to {}: {:?}", centres[0], centres[last], extras.identity);
    assert!(!swapped || extras.identity[last] > extras.identity[0], "another person has the same identity");
}

#[test]
fn the_person_of_the_reference_image_is_tracked_even_if_smaller() {
    let graph = "[0:v]fps=15,scale=-2:720,crop=560:720[a];[1:v]fps=15,scale=400:-2,crop=400:720:0:0[b];[a][b]hstack[v]";
    let inputs = format!("{TYSON} {LARGE}");
    let (Some(without), Some(with)) = (tracked("choice", &inputs, graph), tracked("reference", &inputs, graph)) else {
        return;
    };
    assert!(centres(&without).iter().all(|x| *x < 560.0), "{:?}", centres(&without));
    assert!(centres(&with).iter().all(|x| *x > 560.0), "{:?}", centres(&with));
}
