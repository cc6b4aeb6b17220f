//! Side-by-side films: plan, key and pixels of a study with the preset `rebol`, sessions in a real browser, and votes.

use super::pages::answer_by;
use crate::fixtures::served_study::{Client, MadeStudy, fitting};
use crate::fixtures::study::films::speaker;
use orator_base::stage::progress::Silent;
use orator_base::types::image::Image;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::probe::probe;
use orator_study::build::build;
use orator_study::file::StudyFile;
use orator_study::plan::{StudyKey, StudyPlan};
use orator_study::seal::StudySeal;
use orator_test_support::skip::{browser_driver, skip};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

/// Size of the films, px; the aspect is that of 1000 x 360.
const SIZE: [usize; 2] = [250, 90];

const STUDY: &str = r#"
title = "Short"
preset = "rebol"
participants = 2
extra_session_ratio = 0.0
attention_checks = 1
[clips]
seconds = 1.0
[[speaker]]
name = "host"
dataset = "data"
[[condition]]
name = "model"
kind = "checkpoint"
checkpoint = "models/{speaker}"
[[task]]
name = "real-or-generated"
trials = 2
training = 1
[[task]]
name = "matched-or-mismatched"
trials = 2
training = 1
"#;

/// The study built with small films, its plan and its key.
fn built() -> (MadeStudy, StudyPlan, StudyKey) {
    let inputs = tempfile::tempdir().unwrap();
    speaker(inputs.path());
    fs::write(inputs.path().join("study.toml"), STUDY).unwrap();
    let file = StudyFile::read(&inputs.path().join("study.toml")).unwrap();
    let folder = tempfile::Builder::new().prefix("orator-study-").tempdir().unwrap();
    build(&file, folder.path(), SIZE, &Silent).unwrap();
    let study = MadeStudy::built(folder);
    let (plan, key) = parts(&study);
    (study, plan, key)
}

fn parts(study: &MadeStudy) -> (StudyPlan, StudyKey) {
    let [plan, key] = [study.folder.plan(), study.folder.key()].map(|path| fs::read(path).unwrap());
    (serde_json::from_slice(&plan).unwrap(), serde_json::from_slice(&key).unwrap())
}

/// Number of pixels in columns of an image that differ clearly from the backdrop, the colour of the middle column.
fn n_body_px(image: &Image, columns: std::ops::Range<usize>) -> usize {
    let px = columns.flat_map(|x| (0..image.height).map(move |y| (x, y)));
    let differs = |x: usize, y: usize| {
        let backdrop = image.pixel(image.width / 2, y);
        image.pixel(x, y).iter().zip(backdrop).any(|(a, b)| a.abs_diff(b) > 25)
    };
    px.filter(|(x, y)| differs(*x, *y)).count()
}

#[test]
fn a_rebol_study_shows_both_avatars_in_every_film() {
    let (study, plan, key) = built();
    let trials = || plan.sessions.iter().flat_map(|session| &session.trials);
    assert!(trials().all(|trial| trial.films.len() == 1));
    for (name, content) in &key.films {
        let right = content.right.as_ref().expect("a right avatar");
        for (condition, motion_of) in [(&content.condition, &content.motion_of), (&right.condition, &right.motion_of)] {
            assert_eq!(*motion_of != content.clip, condition == "mismatched", "{content:?}");
        }
        let film = study.folder.film(name);
        let video = probe(&film).unwrap().video.unwrap();
        assert_eq!((video.image_size, video.fps), (SIZE, Some(FrameRate::new(30, 1))));
        let mut frames = FrameReader::open(&film, FrameRate::new(30, 1)).unwrap();
        frames.advance().unwrap().expect("a frame");
        let image = frames.picture(None).unwrap();
        // A trunk and its arms, 0.9 m high and about 0.4 m wide, at 1 px per cm.
        let halves = [0..125, 125..250].map(|columns| n_body_px(&image, columns));
        assert!(halves.iter().all(|n| (1000..8000).contains(n)), "{halves:?}");
    }
    let with_number = trials().find_map(|trial| key.films[&trial.films[0]].number);
    assert!(with_number.is_some(), "an attention check");
}

#[test]
fn votes_on_one_film_have_the_conditions_of_both_avatars() {
    let study = MadeStudy::new(1, 1, 3, 5);
    let (mut plan, mut key) = parts(&study);
    plan.sessions.iter_mut().flat_map(|session| &mut session.trials).for_each(|trial| trial.films.truncate(1));
    for pair in study.films.chunks(2) {
        let both = key.films[&pair[0]].clone().with_right(key.films[&pair[1]].clone());
        key.films.insert(pair[0].clone(), both);
    }
    fs::write(study.folder.plan(), serde_json::to_vec(&plan).unwrap()).unwrap();
    fs::write(study.folder.key(), serde_json::to_vec(&key).unwrap()).unwrap();
    StudySeal::of(&study.folder).unwrap().write(&study.folder).unwrap();
    let served = study.serve(&[]);
    let mut client = Client::new();
    client.begin(&served.address, "p").unwrap();
    for position in 0..3 {
        assert_eq!(client.answer(&served.address, position, &fitting(position, true)).unwrap().0, 200);
    }
    let votes = study.exported("votes");
    assert_eq!(votes.len(), 3);
    for vote in &votes {
        assert_eq!((&vote["conditions"], &vote["response"]), (&json!(["real", "model"]), &vote["expected"]));
    }
}

#[test]
fn side_by_side_sessions_in_a_browser_are_stored_as_answered() {
    let Some(driver) = browser_driver() else { return };
    if Command::new("chromium").arg("--version").output().is_err() {
        return skip("no browser is installed (package chromium)");
    }
    let (study, plan, key) = built();
    // Real motion is preferred to generated motion, and that to mismatched motion.
    let score = |condition: &str| match condition {
        "real" => 1.0,
        "model" => 0.5,
        _ => 0.0,
    };
    let scores: BTreeMap<&String, Vec<f64>> =
        key.films.iter().map(|(film, content)| (film, content.conditions().map(score).collect())).collect();
    let numbers: BTreeMap<&String, u16> =
        key.films.iter().filter_map(|(film, content)| Some((film, content.number?))).collect();
    let rule = json!({ "scores": scores, "numbers": numbers });
    let served = study.serve(&[]);
    for options in ["--width 1280", "--touch --width 360 --height 640 --scheme dark"] {
        let report = answer_by(&rule, &study, &served.address, &driver, options);
        assert_eq!((&report["trials"], &report["problems"]), (&json!(plan.sessions[0].trials.len()), &json!([])));
        assert!(report["code"].is_string(), "{report}");
    }
    let votes = study.exported("votes");
    assert_eq!(votes.len(), 2 * plan.sessions[0].trials.len());
    for vote in &votes {
        assert_eq!(vote["response"], vote["expected"], "{vote}");
        assert_eq!(vote["conditions"].as_array().map(Vec::len), Some(2), "{vote}");
    }
    let is_side = |vote: &&Value| vote["response"]["side"].is_string();
    assert!(votes.iter().filter(is_side).count() >= 8);
}
