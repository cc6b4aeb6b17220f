//! The page of `orator view` in headless Chromium: by keyboard, in both colour schemes and at two widths, with axe-core;
//! decisions that the next run applies, a training followed to its end, motion generated from a dropped sound.

use super::server::{processed, view};
use crate::fixtures::figures::swinging;
use crate::fixtures::viewer::Viewer;
use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_dataset::{Dataset, Split};
use orator_formats::npy;
use orator_test_support::project::Project;
use orator_test_support::skip::{browser_driver, skip};
use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// Packages that drive the browser; `None`: they or the browser are not installed.
fn driver() -> Option<PathBuf> {
    let driver = browser_driver()?;
    if Command::new("chromium").arg("--version").output().is_err() {
        skip("no browser is installed (package chromium)");
        return None;
    }
    Some(driver)
}

/// Report of a script in `browser/`. Its page must have no accessibility findings and no errors.
fn visit(driver: &PathBuf, script: &str, viewer: &Viewer, options: &[&str]) -> Value {
    let mut command = Command::new("node");
    command.arg(format!("tests/it/view/browser/{script}.mjs")).args(["--url", &viewer.url]).args(options);
    let done = command.env("ORATOR_DRIVER", driver).output().unwrap();
    assert!(done.status.success(), "{script} {options:?}: {}", String::from_utf8_lossy(&done.stderr));
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    let findings = report.as_object().unwrap().iter().filter(|(key, _)| key.starts_with("findings"));
    assert!(findings.into_iter().all(|(_, found)| *found == json!([])), "{script} {options:?}: {report}");
    assert_eq!(report["problems"], json!([]), "{script} {options:?}");
    report
}

fn video_id(viewer: &Viewer) -> String {
    viewer.json("api/videos")["videos"][0]["id"].as_str().unwrap().to_owned()
}

/// Replaces the ledger of the video by one with 10,000 intervals of a second.
fn divide(project: &Project) {
    let mut ledger = Ledger { duration_secs: 10_000.0, ..Ledger::default() };
    for second in 0..10_000 {
        let (start_secs, end_secs) = (f64::from(second), f64::from(second + 1));
        if second % 2 == 0 {
            ledger.accepted.push(AcceptedInterval { start_secs, end_secs });
        } else {
            let reasons = [Rejection::HandGap, Rejection::Quiet, Rejection::Cut];
            let why = FrameRejection::new(reasons[second as usize / 2 % 3], 1.0, 2.0);
            ledger.rejected.push(RejectedInterval::new(start_secs, end_secs, why));
        }
    }
    fs::remove_file(project.written("lift", "clip-1", "joints.npz")).unwrap();
    fs::write(project.written("lift", "clip-1", "ledger.json"), serde_json::to_vec(&ledger).unwrap()).unwrap();
}

#[test]
fn a_project_is_corrected_in_the_page_and_the_next_run_applies_it() {
    let Some(driver) = driver() else { return };
    let project = processed();
    let viewer = view(&project, &["--edit", "--author", "ana"]);
    let id = video_id(&viewer);
    for options in [&["--width", "1280"][..], &["--width", "360", "--scheme", "dark"]] {
        let report = visit(&driver, "dataset", &viewer, &[&["--video", &id], options].concat());
        eprintln!("opened after {} ms", report["openedMs"]);
        let made: Vec<&str> = report["made"].as_array().unwrap().iter().map(|row| row[0].as_str().unwrap()).collect();
        assert!(made.len() == 2 && made.iter().any(|row| row.starts_with("Reject")), "{report}");
        assert_eq!((&report["left"], &report["isFocusKept"]), (&json!([]), &json!(true)), "{report}");
        let [stepped, shifted] = ["steppedSecs", "shiftedSecs"].map(|key| report[key].as_f64().unwrap());
        assert!((stepped - 2.5 / 15.0).abs() < 0.02 && (shifted - stepped - 1.0).abs() < 0.02, "{report}");
        assert_eq!((&report["hash"], &report["shownAfterReload"]), (&json!("#run"), &json!("panel-run")));
    }
    assert!(!project.dir().join("decisions.toml").exists(), "all decisions were undone");

    let secs = || -> f64 {
        let dataset = Dataset::open(project.work().join("dataset/host")).unwrap();
        dataset.samples(Split::Train).iter().map(|sample| sample.n_frames as f64 / 15.0).sum()
    };
    let before = secs();
    visit(&driver, "reject", &viewer, &["--video", &id]);
    let text = fs::read_to_string(project.dir().join("decisions.toml")).unwrap();
    assert!(text.contains("author = \"ana\"") && text.contains("action = \"reject\""), "{text}");
    let run = project.run(&[]);
    assert_eq!(run.code, 0, "{}", run.errors);
    let video = viewer.json(&format!("api/videos/{id}"));
    let rejected = video["rejected"][0].clone();
    assert_eq!((&rejected[0], &rejected[2]), (&json!(0.0), &json!("by hand")), "{video}");
    assert!(rejected[3].as_str().unwrap().contains("ana") && rejected[1].as_f64().unwrap() >= 0.9, "{rejected}");
    assert!(before - secs() > 0.8, "{before} s, then {} s", secs());
    let card = fs::read_to_string(project.work().join("dataset/host/README.md")).unwrap();
    assert!(card.contains("1 reject (ana)"), "{card}");
    // Undone, the next run restores the dataset.
    let decision = video["decisions"][0]["id"].as_str().unwrap();
    assert_eq!(viewer.delete(&format!("api/decisions/{decision}")), 200);
    assert_eq!(viewer.delete(&format!("api/decisions/{decision}")), 404);
    assert_eq!(project.run(&[]).code, 0);
    assert!((before - secs()).abs() < 1e-9);

    divide(&project);
    let report = visit(&driver, "intervals", &viewer, &["--video", &id]);
    eprintln!(
        "10,000 intervals: opened after {} ms, tasks above 50 ms: {} while scrolling, {} on the timeline",
        report["openedMs"], report["longWhileScrolling"], report["longOnTimeline"]
    );
    assert!(report["rows"] == 10_000 && report["nodes"].as_u64().unwrap() < 60, "{report}");
    assert!(report["distinct"].as_u64().unwrap() > 250 && report["openedMs"].as_u64().unwrap() < 20_000, "{report}");
}

#[test]
fn a_training_is_followed_to_its_end_and_generates_in_the_page() {
    let Some(driver) = driver() else { return };
    let project = processed();
    fs::remove_dir_all(project.work().join("gan/host")).unwrap();
    let settings = ["--set", "gan.preset=small", "--set", "gan.batch=8", "--set", "gan.epoch_steps=20"];
    let mut training =
        project.start(&[&["train", "gan", "--speaker", "host", "--steps", "60"][..], &settings].concat());
    let log = project.work().join("gan/host/metrics.jsonl");
    let begun = Instant::now();
    while fs::metadata(&log).map_or(0, |file| file.len()) == 0 {
        assert!(begun.elapsed() < Duration::from_secs(120), "the training does not start");
        std::thread::sleep(Duration::from_millis(50));
    }
    let viewer = view(&project, &[]);
    let report = visit(&driver, "training", &viewer, &[]);
    assert!(training.wait().unwrap().success());
    assert_eq!(report["atEnd"], json!([60, 60]), "{report}");
    assert!(report["atFirst"][0].as_f64() < Some(60.0) && report["drawn"].as_f64() > Some(0.005), "{report}");
    assert_eq!(report["captions"].as_array().unwrap().len(), 2);

    npy::write(&project.dir().join("still.npy"), &swinging(1, 20)).unwrap();
    assert_eq!(project.answer(&["animate", "still.npy", "--out", "own.vrm"]).code, 0);
    let [sound, avatar] = ["speech.wav", "own.vrm"].map(|name| project.dir().join(name).display().to_string());
    let report = visit(&driver, "result", &viewer, &["--sound", &sound, "--avatar", &avatar, "--width", "360"]);
    assert_eq!(report["made"], 2, "{report}");
    let links: Vec<&str> = report["links"].as_array().unwrap().iter().map(|link| link.as_str().unwrap()).collect();
    assert!(["BVH", "GLB", "VRMA"].iter().all(|link| links.contains(link)), "{links:?}");
    assert!(report["drawn"].as_f64() > Some(0.005) && report["ownAvatar"].as_f64() > Some(0.005), "{report}");

    let file = view(&project, &["own.vrm"]);
    assert!(visit(&driver, "file", &file, &["--scheme", "dark"])["drawn"].as_f64() > Some(0.005));
    let file = view(&project, &["still.npy"]);
    let report = visit(&driver, "file", &file, &["--width", "360"]);
    assert!(report["drawn"].as_f64() > Some(0.005) && report["played"].as_f64() > Some(0.5), "{report}");
}
