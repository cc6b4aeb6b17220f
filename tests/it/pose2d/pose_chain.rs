//! The 2D chain and its stage on unusual input: image sizes, videos without a person, inconsistent files.

use crate::fixtures::clips;
use crate::fixtures::onnx_models::models;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::image::Image;
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_dataset::config::Settings;
use orator_formats::keypoints_npz;
use orator_formats::media_json::MediaInfo;
use orator_formats::timeline_npz::Timeline;
use orator_onnx::ModelState;
use orator_pipeline::pose2d::{Chain, Pose2dStage};
use orator_test_support::skip::skip;
use std::path::Path;

fn noise(width: usize, height: usize) -> Image {
    let byte = |k: usize| (k.wrapping_mul(2_654_435_761) >> 13) as u8;
    Image { width, height, data: (0..3 * width * height).map(byte).collect() }
}

#[test]
fn any_image_gives_finite_keypoints() {
    let Some((store, runtime)) = models() else { return };
    // Without a person detector the full image is the person box, so all models run on it.
    for person in ["person-rtmdet-nano", "person-yolox-nano", ""] {
        if store.manifest().get(person).is_ok_and(|entry| store.state(entry) != ModelState::Present) {
            skip(&format!("{person} is not among the fetched models"));
            continue;
        }
        let settings = config::Pose2dConfig {
            person: person.into(),
            joint_score: 0.0,
            hand_score: 0.0,
            palm_every: 1,
            ..config::Pose2dConfig::default()
        };
        let mut chain = Chain::new(&runtime, &store, &settings).unwrap();
        for (width, height) in [(1, 1), (3, 200), (641, 7), (320, 241)] {
            for image in [noise(width, height), Image::filled(width, height, [0; 3])] {
                let pose = chain.frame(&image).unwrap();
                let points = pose.body.iter().chain(&pose.left_hand).chain(&pose.right_hand);
                assert!(points.clone().all(|p| [p.x, p.y, p.score].iter().all(|number| number.is_finite())));
                assert!(person.is_empty() || pose.person.score.is_finite());
            }
        }
        chain.begin_shot(None);
        assert!(chain.secs_inside() > 0.0);
    }
}

#[test]
fn settings_with_an_unsuitable_model_are_errors_with_the_key() {
    let Some((store, runtime)) = models() else { return };
    let error =
        |settings: config::Pose2dConfig| format!("{:#}", Chain::new(&runtime, &store, &settings).err().unwrap());
    let unknown = error(config::Pose2dConfig { body: "nothing".into(), ..config::Pose2dConfig::default() });
    assert!(unknown.contains("pose2d.body") && unknown.contains("body-tinypose-256x192"), "{unknown}");
    assert!(
        error(config::Pose2dConfig { person: "hand-mediapipe-lite".into(), ..config::Pose2dConfig::default() })
            .contains("Hand")
    );
    assert!(
        error(config::Pose2dConfig { hand: String::new(), ..config::Pose2dConfig::default() })
            .contains("has no hand keypoints")
    );
}

/// A unit with a video of `n` frames at 30 fps, and the settings of a run in `dir`.
fn unit(dir: &Path, n: usize, models: &Path) -> (Unit, Settings) {
    let source = clips::write_sized(dir, "nobody.mp4", n, FrameRate::new(30, 1), [160, 96], None);
    let unit = Unit { speaker: "host".into(), video: "nobody-00000000".into(), source };
    let mut settings = Settings::default();
    settings.work.dir = dir.join("work");
    settings.models.dir = models.to_owned();
    (unit, settings)
}

fn write_timeline(settings: &Settings, unit: &Unit, restart: Vec<bool>) {
    let folder = settings.work.dir.join("extract").join(&unit.speaker).join(&unit.video);
    std::fs::create_dir_all(&folder).unwrap();
    let n_frames = restart.len();
    let timeline = Timeline {
        source_secs: vec![0.0; n_frames],
        repeated: vec![false; n_frames],
        shot_score: vec![0.0; n_frames],
        restart,
        span: vec![false; n_frames],
        frame_difference: vec![1.0; n_frames],
    };
    timeline.write(&folder.join("timeline.npz")).unwrap();
    MediaInfo::new(n_frames as f64 / 15.0, n_frames, FrameRate::new(15, 1)).write(&folder.join("media.json")).unwrap();
}

#[test]
fn a_video_without_a_person_gives_zeros_and_not_a_failure() {
    let Some((store, _)) = models() else { return };
    let dir = tempfile::tempdir().unwrap();
    let (unit, settings) = unit(dir.path(), 20, store.dir());
    write_timeline(&settings, &unit, (0..10).map(|t| t == 6).collect());
    let stage = Pose2dStage::new(&settings).unwrap();
    let roles: Vec<_> = stage.inputs(&unit).unwrap().into_iter().map(|input| input.role).collect();
    let all = ["video", "timeline", "media", "model:person", "model:body", "model:hand", "model:palm", "model:face"];
    // Only the face model is optional.
    let has_face = store.path(store.manifest().get("face-mediapipe").unwrap()).is_file();
    assert_eq!(roles, all[..all.len() - usize::from(!has_face)]);
    assert!(stage.settings(&unit)["models"]["body"]["sha256"].is_string());
    let written: Vec<_> = ["a", "b"]
        .iter()
        .map(|name| {
            let out = dir.path().join(name);
            std::fs::create_dir(&out).unwrap();
            let report = stage.run(&unit, &out, &Silent).unwrap();
            assert!(report.line.starts_with("10 frames: person in 0 %"), "{}", report.line);
            let path = out.join("keypoints.npz");
            let keypoints = keypoints_npz::read(&path).unwrap();
            assert_eq!((keypoints.n_frames(), keypoints.image_size), (10, [160, 96]));
            assert!(keypoints.body.iter().chain(&keypoints.left_hand).all(|number| *number == 0.0));
            std::fs::read(path).unwrap()
        })
        .collect();
    assert_eq!(written[0], written[1]);
}

#[test]
fn a_timeline_of_another_length_and_a_missing_model_are_errors() {
    let Some((store, _)) = models() else { return };
    let dir = tempfile::tempdir().unwrap();
    let (unit, mut settings) = unit(dir.path(), 20, store.dir());
    for n_frames in [3, 12] {
        write_timeline(&settings, &unit, vec![false; n_frames]);
        let error = Pose2dStage::new(&settings).unwrap().run(&unit, dir.path(), &Silent).unwrap_err().to_string();
        assert!(error.contains(&format!("its timeline {n_frames}")), "{error}");
    }
    settings.models.dir = dir.path().to_owned();
    let error = Pose2dStage::new(&settings).unwrap().inputs(&unit).unwrap_err().to_string();
    assert!(error.contains("person_rtmdet_nano_320.onnx") && error.contains("orator models fetch"), "{error}");
}
