//! The synthetic speaker in footage as users have it: interlaced, letterboxed, mirrored, after a title slide. Keypoints
//! are compared with the ground truth of the drawing.

use crate::fixtures::clips::ffmpeg;
use ndarray::{Array3, Axis};
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::pose2d::Keypoints;
use orator_base::types::time::FrameRate;
use orator_formats::keypoints_npz;
use orator_formats::media_json::MediaInfo;
use orator_pipeline::pose2d::Pose2dStage;
use orator_test_support::drawn::folder::DemoPlan;
use orator_test_support::drawn::truth::DrawnTruth;
use orator_test_support::project::Project;
use std::path::Path;

fn plan(secs: f64, fps: u32, size: [usize; 2]) -> DemoPlan {
    DemoPlan { n_videos: 1, secs, fps: FrameRate::new(fps, 1), size, seed: 7 }
}

fn truth(project: &Project) -> DrawnTruth {
    DrawnTruth::read(&project.dir().join("truth/clip-1.npz")).unwrap()
}

fn media(project: &Project, stem: &str) -> MediaInfo {
    MediaInfo::read(&project.written("extract", stem, "media.json")).unwrap()
}

/// Sorted distances of the hand keypoints from the truth, px; `transform` maps a true point to the image. An undetected
/// point counts as 100 px.
fn errors(keypoints: &Keypoints, truth: &DrawnTruth, transform: impl Fn([f32; 2]) -> [f32; 2]) -> Vec<f32> {
    let mut errors = Vec::new();
    let pairs: [(&Array3<f32>, &Array3<f32>); 2] =
        [(&keypoints.left_hand, &truth.left_hand), (&keypoints.right_hand, &truth.right_hand)];
    for (found, true_points) in pairs {
        for (found, expected) in found.axis_iter(Axis(0)).zip(true_points.axis_iter(Axis(0))) {
            for (point, expected) in found.outer_iter().zip(expected.outer_iter()) {
                let [x, y] = transform([expected[0], expected[1]]);
                errors.push(if point[2] > 0.0 { (point[0] - x).hypot(point[1] - y) } else { 100.0 });
            }
        }
    }
    errors.sort_by(f32::total_cmp);
    errors
}

fn quantile(errors: &[f32], share: f64) -> f32 {
    errors[((errors.len() - 1) as f64 * share) as usize]
}

#[test]
fn deinterlacing_reduces_the_keypoint_error() {
    let project = Project::drawn("interlaced", &plan(4.0, 60, [960, 720]));
    let options = "-vf tinterlace=interleave_top -c:v libx264 -crf 12 -c:a copy";
    let videos = project.video("");
    let written = ["flagged.mp4 -flags +ildct+ilme", "silent.mp4 -bsf:v null"].map(|name| {
        let (name, flags) = name.split_once(' ').unwrap();
        ffmpeg(&videos, &format!("-i clip-1.mp4 {options} {flags} {name}"))
    });
    if written.contains(&false) {
        return;
    }
    std::fs::remove_file(project.video("clip-1.mp4")).unwrap();
    let answer = project.run(&["--to", "pose2d"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let truth = truth(&project);
    let settings = orator::load_config(&project.dir().join("pipeline.toml"), &[]).unwrap().settings;
    for stem in ["flagged", "silent"] {
        assert!(media(&project, stem).pictures.deinterlace, "{stem}");
        let path = project.written("pose2d", stem, "keypoints.npz");
        let deinterlaced = errors(&keypoints_npz::read(&path).unwrap(), &truth, |point| point);
        // Runs the stage again, without the note that the video is interlaced.
        let plain = MediaInfo { pictures: Default::default(), ..media(&project, stem) };
        plain.write(&project.written("extract", stem, "media.json")).unwrap();
        let video = path.parent().unwrap().file_name().unwrap().to_string_lossy().into_owned();
        let unit = Unit { speaker: "host".into(), video, source: project.video(&format!("{stem}.mp4")) };
        let out = tempfile::tempdir().unwrap();
        Pose2dStage::new(&settings).unwrap().run(&unit, out.path(), &Silent).unwrap();
        let combed = errors(&keypoints_npz::read(&out.path().join("keypoints.npz")).unwrap(), &truth, |point| point);
        let shares = [0.5, 0.9, 0.95];
        let [combed, deinterlaced] = [combed, deinterlaced].map(|errors| shares.map(|share| quantile(&errors, share)));
        eprintln!(
            "{stem}: median, 90 % and 95 % of the errors {combed:.2?} px combed, {deinterlaced:.2?} px deinterlaced"
        );
        assert!(deinterlaced[0] < combed[0] && deinterlaced[1] < combed[1], "{stem}: {combed:?} {deinterlaced:?}");
    }
}

#[test]
fn bars_beside_portrait_footage_are_excluded_from_detection() {
    let project = Project::drawn("bars", &plan(4.0, 15, [360, 640]));
    let videos = project.video("");
    let black = "-vf pad=1138:640:388:0:black -c:v libx264 -crf 12 -c:a copy black.mp4";
    let blurred = "-filter_complex [0:v]split[a][b];[a]scale=1138:2024,crop=1138:640,boxblur=24:2[c];[c][b]overlay=388:0 \
                   -c:v libx264 -crf 12 -c:a copy blurred.mp4";
    if !ffmpeg(&videos, &format!("-i clip-1.mp4 {black}")) || !ffmpeg(&videos, &format!("-i clip-1.mp4 {blurred}")) {
        return;
    }
    let answer = project.run(&["--to", "pose2d"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let truth = truth(&project);
    let found = |stem: &str, shift: f32| {
        let keypoints = keypoints_npz::read(&project.written("pose2d", stem, "keypoints.npz")).unwrap();
        let errors = errors(&keypoints, &truth, |[x, y]| [x + shift, y]);
        (keypoints.image_size, [0.5, 0.9].map(|share| quantile(&errors, share)))
    };
    let (size, plain) = found("clip-1", 0.0);
    assert_eq!((size, media(&project, "clip-1").active_area), ([360, 640], None));
    for stem in ["black", "blurred"] {
        let area = media(&project, stem).active_area.expect(stem);
        assert!(area.x.abs_diff(388) <= 2 && area.width.abs_diff(360) <= 4, "{stem}: {area:?}");
        assert_eq!((area.y, area.height), (0, 640));
        let (size, with_bars) = found(stem, 388.0);
        eprintln!("{stem}: {area:?}, median and 90 % of the errors {with_bars:.2?} px, without bars {plain:.2?} px");
        assert_eq!(size, [1138, 640]);
        assert!(with_bars[0] < plain[0] + 0.5 && with_bars[1] < plain[1] + 2.0, "{stem}: {with_bars:?}, {plain:?}");
    }
}

#[test]
fn a_video_that_is_configured_as_mirrored_is_flipped_back() {
    let project = Project::drawn("mirrored", &plan(3.0, 15, [640, 480]));
    let flipped = "-i clip-1.mp4 -vf hflip -c:v libx264 -crf 12 -c:a copy selfie.mp4";
    if !ffmpeg(&project.video(""), flipped) {
        return;
    }
    let file = project.dir().join("pipeline.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let with_entry =
        |entry: &str| text.replacen("name = \"host\"", &format!("name = \"host\"\nmirrored = [\"{entry}\"]"), 1);
    std::fs::write(&file, with_entry("self*.mp4")).unwrap();
    let answer = project.run(&["--to", "pose2d"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let truth = truth(&project);
    for (stem, mirrored) in [("clip-1", false), ("selfie", true)] {
        assert_eq!(media(&project, stem).pictures.mirrored, mirrored, "{stem}");
        let keypoints = keypoints_npz::read(&project.written("pose2d", stem, "keypoints.npz")).unwrap();
        let found = errors(&keypoints, &truth, |point| point);
        assert!(quantile(&found, 0.5) < 1.0 && quantile(&found, 0.9) < 8.0, "{stem}: {}", quantile(&found, 0.9));
    }
    // Without the key the video is stale.
    std::fs::write(&file, &text).unwrap();
    let plans = project.answer(&["status"]).json.to_string();
    assert!(plans.contains("stale"), "{plans}");
    std::fs::write(&file, with_entry("absent.mp4")).unwrap();
    let answer = project.run(&["--to", "extract"]);
    assert!(
        answer.errors.contains("mirrored = [\"absent.mp4\"]") || answer.json.to_string().contains("absent.mp4"),
        "{}",
        answer.errors
    );
}

#[test]
fn a_title_slide_is_rejected_as_static_and_the_rest_accepted() {
    let project = Project::drawn("slide", &plan(10.0, 15, [640, 480]));
    // A static image of the speaker with a tone, followed by the speaker.
    let slide = "[0:v]trim=end_frame=1,loop=44:1:0,scale=320:240,pad=640:480:40:120:navy,setsar=1,setpts=N/15/TB[s]";
    let join = "[0:v]setsar=1[v];[s][1:a][v][0:a]concat=n=2:v=1:a=1[o][p]";
    let args = format!(
        "-i clip-1.mp4 -f lavfi -i sine=frequency=440:duration=3 -filter_complex {slide};{join} -map [o] -map [p] -r 15 \
         -c:v libx264 -crf 12 intro.mp4"
    );
    if !ffmpeg(&project.video(""), &args) {
        return;
    }
    let answer = project.run(&["--to", "segment"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let ledger = |stem: &str| Ledger::read(Path::new(&project.written("segment", stem, "ledger.json"))).unwrap();
    let (plain, intro) = (ledger("clip-1"), ledger("intro"));
    let first = &intro.rejected[0];
    eprintln!("accepted: plain {:.2} s, with intro {:.2} s, {first:?}", plain.accepted_secs(), intro.accepted_secs());
    assert!(first.start_secs == 0.0 && (first.end_secs - 3.0).abs() < 0.2, "{first:?}");
    assert_eq!(first.reason, "still", "{first:?}");
    assert!(
        (intro.accepted_secs() - plain.accepted_secs()).abs() < 0.3,
        "{} {}",
        intro.accepted_secs(),
        plain.accepted_secs()
    );
    // The slide does not affect the person choice: after it, the keypoints are as accurate as without it.
    let truth = truth(&project);
    let keypoints = keypoints_npz::read(&project.written("pose2d", "intro", "keypoints.npz")).unwrap();
    let after = Keypoints {
        left_hand: keypoints.left_hand.slice(ndarray::s![45.., .., ..]).to_owned(),
        right_hand: keypoints.right_hand.slice(ndarray::s![45.., .., ..]).to_owned(),
        ..keypoints
    };
    let found = errors(&after, &truth, |point| point);
    assert!(
        quantile(&found, 0.5) < 1.0 && quantile(&found, 0.9) < 8.0,
        "{} {}",
        quantile(&found, 0.5),
        quantile(&found, 0.9)
    );
}
