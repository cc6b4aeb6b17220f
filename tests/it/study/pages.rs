//! Complete sessions of every design in a real browser against the real server: by keyboard only and by touch only,
//! light and dark, with a reload, a network failure, a hidden page and a withdrawal; axe-core audits every step.

use crate::fixtures::served_study::{Client, MadeStudy, fitting};
use orator_study::plan::{PlannedTask, StudyPlan, TaskDesign, Trial, TrialPhase};
use orator_study::seal::StudySeal;
use orator_study::vote::{Response, ScreenSide};
use orator_test_support::skip::{browser_driver, skip};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Study of all designs, ten trials with films of 1.6 s; the films of even index are preferred.
fn every_design(n_sessions: usize) -> MadeStudy {
    let study = MadeStudy::new(n_sessions, n_sessions, 4, 40);
    let mut plan: StudyPlan = serde_json::from_slice(&fs::read(study.folder.plan()).unwrap()).unwrap();
    let designs = [
        (TaskDesign::Turing, false, ""),
        (TaskDesign::TuringSingle, true, ""),
        (TaskDesign::Preference, false, ""),
        (TaskDesign::Mismatch, false, ""),
        (TaskDesign::Sliders, true, "human-likeness"),
        (TaskDesign::Sliders, false, "appropriateness"),
    ];
    let task = |(k, (design, replay, scale)): (usize, (TaskDesign, bool, &str))| PlannedTask {
        name: format!("task-{k}"),
        design,
        replay,
        scale: scale.to_owned(),
    };
    plan.tasks = designs.into_iter().enumerate().map(task).collect();
    let films = |indices: &[usize]| indices.iter().map(|k| study.films[*k].clone()).collect::<Vec<_>>();
    let trial = |task, phase, indices: &[usize], expected| Trial { task, phase, films: films(indices), expected };
    let side = |side| Some(Response::Side(side));
    let trials = vec![
        trial(0, TrialPhase::Practice, &[0, 1], None),
        trial(0, TrialPhase::Training, &[2, 3], side(ScreenSide::Left)),
        trial(0, TrialPhase::Main, &[5, 4], None),
        trial(0, TrialPhase::AttentionCheck, &[6, 7], Some(Response::Number(42))),
        trial(1, TrialPhase::Main, &[0], None),
        trial(2, TrialPhase::Main, &[1, 0], None),
        trial(3, TrialPhase::Training, &[2, 3], side(ScreenSide::Right)),
        trial(4, TrialPhase::Main, &[0, 1, 2], None),
        trial(4, TrialPhase::AttentionCheck, &[1, 6, 3], Some(Response::Number(42))),
        trial(5, TrialPhase::Main, &[4, 5, 6, 7], None),
    ];
    plan.sessions.iter_mut().for_each(|session| session.trials.clone_from(&trials));
    plan.sound_check.clone_from(&study.films[0]);
    fs::write(study.folder.plan(), serde_json::to_vec(&plan).unwrap()).unwrap();
    let file = fs::read_to_string(study.folder.study_file()).unwrap();
    fs::write(study.folder.study_file(), file.replace("[\"en\"]", "[\"en\", \"de\", \"ar\"]")).unwrap();
    StudySeal::of(&study.folder).unwrap().write(&study.folder).unwrap();
    study
}

/// Takes part at `address` by the rule of `study`, and returns the report of the participant.
fn take_part(study: &MadeStudy, address: &str, driver: &Path, options: &str) -> Value {
    let score = |k: usize| if k.is_multiple_of(2) { 0.9 } else { 0.1 };
    let scores: BTreeMap<_, _> = study.films.iter().enumerate().map(|(k, film)| (film, score(k))).collect();
    let rule = json!({ "scores": scores, "numbers": { &study.films[6]: 42 } });
    answer_by(&rule, study, address, driver, options)
}

/// Takes part at `address` by a rule of `participant.mjs`, and returns the report of the participant.
pub(super) fn answer_by(rule: &Value, study: &MadeStudy, address: &str, driver: &Path, options: &str) -> Value {
    let answers = study.path().join("answers.json");
    fs::write(&answers, rule.to_string()).unwrap();
    let mut command = Command::new("node");
    command.arg("tests/it/study/browser/participant.mjs").env("ORATOR_DRIVER", driver);
    command.args(["--audit", "--url", &format!("http://{address}/"), "--answers"]).arg(&answers);
    let done = command.args(options.split_whitespace()).output().unwrap();
    assert!(done.status.success(), "{options}: {}", String::from_utf8_lossy(&done.stderr));
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(report["findings"], json!([]), "{options}");
    report
}

fn is_code(report: &Value) -> bool {
    report["code"].as_str().is_some_and(|code| code.len() == 10)
}

#[test]
fn sessions_by_keyboard_and_by_touch_are_stored_as_answered() {
    let Some(driver) = browser_driver() else { return };
    if Command::new("chromium").arg("--version").output().is_err() {
        return skip("no browser is installed (package chromium)");
    }
    let study = every_design(3);
    let served = study.serve(&[]);
    let by_keyboard =
        take_part(&study, &served.address, &driver, "--width 1280 --language en --away-at 1 --interrupt-at 5");
    let dark = "--width 360 --height 640 --touch --scheme dark --language ar --reload-at 1 --offline-at 2";
    let by_touch = take_part(&study, &served.address, &driver, dark);
    for report in [&by_keyboard, &by_touch] {
        eprintln!("offset of the films at the start and later, ms: {}", report["offsets_ms"]);
        assert!(is_code(report) && report["trials"] == 10, "{report}");
        // Two frames in most of the trials: a machine under load corrects late.
        let offsets = report["offsets_ms"].as_array().unwrap();
        let n_near = offsets.iter().filter(|offset| offset[1].as_u64().unwrap() <= 80).count();
        assert!(2 * n_near > offsets.len(), "{report}");
    }
    assert_eq!(by_keyboard["problems"], json!([]));
    let withdrawn = take_part(&study, &served.address, &driver, "--touch --width 360 --language de --withdraw-at 2");
    assert_eq!(withdrawn["code"], Value::Null);

    let votes = study.exported("votes");
    assert_eq!(votes.len(), 20, "a withdrawal leaves no votes");
    let expected = [
        json!({ "side": "left" }),
        json!({ "side": "left" }),
        json!({ "side": "right" }),
        json!({ "number": 42 }),
        json!({ "real": true }),
        json!({ "step": 2 }),
        json!({ "side": "left" }),
    ];
    for votes in votes.chunks(10) {
        for (vote, expected) in votes.iter().zip(&expected) {
            assert_eq!(vote["response"], *expected, "{vote}");
        }
        assert_eq!(votes[8]["response"], json!({ "number": 42 }));
        for (at, wanted) in [(7, &[90, 10, 90][..]), (9, &[90, 10, 90, 10])] {
            let scores = votes[at]["response"]["scores"].as_array().unwrap().clone();
            assert_eq!(scores.len(), wanted.len());
            // Touch is less exact than the keyboard.
            let is_near = |(score, wanted): (&Value, &i64)| (score.as_i64().unwrap() - wanted).abs() <= 6;
            assert!(scores.iter().zip(wanted).all(is_near), "{scores:?}");
        }
    }
    let plays = |at: usize| votes[at]["plays"].as_u64().unwrap();
    assert_eq!((plays(1), plays(11)), (1, 2), "a reload during a film counts as a play");
    let reloads: Vec<Value> = votes.iter().map(|vote| vote["reloads"].clone()).collect();
    let expected: Vec<Value> = (0..20).map(|at| json!(u32::from(at == 11))).collect();
    assert_eq!(reloads, expected, "only the trial whose film was reloaded");
    // The page was hidden for a second, which counts as far as the film was still playing.
    assert!(votes[1]["unfocused_secs"].as_f64().unwrap() >= 0.3, "{}", votes[1]);
}

/// JSON printed by a script of the folder `browser`.
fn script(driver: &Path, name: &str, args: &[&str]) -> Value {
    let mut command = Command::new("node");
    command.arg(format!("tests/it/study/browser/{name}.mjs")).args(args).env("ORATOR_DRIVER", driver);
    let done = command.output().unwrap();
    assert!(done.status.success(), "{name}: {}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}

#[test]
fn sessions_resume_by_token_and_by_the_operators_link() {
    let Some(driver) = browser_driver() else { return };
    if Command::new("chromium").arg("--version").output().is_err() {
        return skip("no browser is installed (package chromium)");
    }
    let study = MadeStudy::new(3, 3, 4, 5).requiring_id();
    let served = study.serve(&[]);
    let page = |path: &str| format!("http://{}/{path}", served.address);
    let visit = |url: &str| script(&driver, "visit", &["--url", url]);
    let expected = |headings: [&str; 2], begins: u32| json!({ "headings": headings, "begins": begins, "fragment": "" });
    assert_eq!(visit(&page("")), expected(["Your participant ID is missing", "Taking part"], 1));
    let recruited = page("?PROLIFIC_PID=p1");
    assert_eq!(visit(&recruited), expected(["Which one is more natural?", "Welcome back"], 1));

    let operator = Client { token: served.operator_token.clone(), ..Client::new() };
    let progress = operator.get(&served.address, "/api/operator").unwrap().1;
    let token = progress["participants"][0]["token"].as_str().unwrap().to_owned();
    let first = Client { token, ..Client::new() };
    assert_eq!(first.answer(&served.address, 0, &fitting(0, true)).unwrap().0, 200);
    assert_eq!(visit(&recruited), expected(["You have already started", "Taking part"], 1));

    // A second participant fails the attention check.
    let mut inattentive = Client::new();
    inattentive.begin(&served.address, "p2").unwrap();
    for position in 0..4 {
        assert_eq!(inattentive.answer(&served.address, position, &fitting(position, false)).unwrap().0, 200);
    }
    let shown = script(&driver, "operator", &["--url", &page("operator"), "--token", &served.operator_token]);
    assert_eq!((&shown["findings"], &shown["problems"]), (&json!([]), &json!([])));
    let quota = [
        ["Target number of participants", "3"],
        ["Completed", "0"],
        ["In progress", "1"],
        ["Abandoned: no answer for too long, session can be reassigned", "0"],
        ["Completed, excluded for failed attention checks", "1"],
        ["Session reassigned to another participant", "0"],
        ["Withdrawn, data deleted", "0"],
        ["Stored answers", "5"],
        ["Trials with stalled playback", "5"],
        ["Total stalled time, s", "1"],
    ];
    assert_eq!(shown["quota"], json!(quota));
    let sessions = shown["sessions"].as_array().unwrap();
    assert_eq!((&sessions[0][0], &sessions[0][1], &sessions[0][2]), (&json!("1"), &json!("active"), &json!("1 of 4")));
    assert_eq!((&sessions[1][1], &sessions[1][4]), (&json!("completed"), &json!("Link to resume")), "link to the code");
    let link = shown["links"][0].as_str().unwrap();
    assert_eq!(visit(link), expected(["Welcome back", "Welcome back"], 0));

    // The first reply is dropped and the browser has no storage: the address contains the token.
    let visited = script(&driver, "visit", &["--url", &page("?PROLIFIC_PID=p3"), "--adverse"]);
    assert_eq!(
        (&visited["headings"], &visited["begins"]),
        (&json!(["Which one is more natural?", "Welcome back"]), &json!(2))
    );
    assert!(visited["fragment"].as_str().unwrap().starts_with("#resume="), "{visited}");
}
