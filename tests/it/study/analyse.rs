//! `orator study analyse` on tables of votes: the counts of a published study, a simulated study of every design with a
//! known preference, and damaged tables; its report in a browser.

use crate::fixtures::browser::Browser;
use crate::fixtures::study::votes::{Rng32, counted_votes, votes_of_all_designs};
use orator_study::analyse::result::StatisticSettings;
use orator_study::analyse::statistic::StatisticMethod;
use orator_study::analyse::votes::columns::ColumnNames;
use orator_study::analyse::votes::read::VotesRead;
use orator_study::analyse::{Registration, analyse};
use orator_study::file::{AnalysisSettings, ExclusionRules, HypothesisKind, StudyHypothesis};
use orator_study::preregistration::RegisteredHypothesis;
use orator_test_support::project::Project;
use serde_json::Value;

fn near(found: &Value, expected: f64, within: f64) {
    let number = found.as_f64().unwrap_or(f64::NAN);
    assert!((number - expected).abs() <= within, "{found} {expected}");
}

/// Entry of a list of statistics by method.
fn by(statistics: &Value, method: &str) -> Value {
    let found = statistics.as_array().unwrap().iter().find(|statistic| statistic["method"] == method);
    found.unwrap_or_else(|| panic!("no {method} in {statistics}")).clone()
}

/// Counts of Rebol, Guetl and Pietroszek 2021, from the shares in section 4.5: 512 and 538 of 1,000 votes chose the
/// generated gestures as the real ones, 356 and 294 of 500 the matching ones.
#[test]
fn counts_of_a_published_study_give_the_known_results() {
    let project = Project::with_clips("study-counts", 0, 1.0);
    let table = counted_votes(&[
        ("real-or-generated", "turing", "oliver", 1000 - 512, 1000),
        ("real-or-generated", "turing", "gruber", 1000 - 538, 1000),
        ("matched-or-mismatched", "mismatch", "oliver", 356, 500),
        ("matched-or-mismatched", "mismatch", "gruber", 294, 500),
    ]);
    std::fs::write(project.dir().join("votes.csv"), table).unwrap();
    let answer = project.answer(&["study", "analyse", "votes.csv", "--draws", "400"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let analysis = &answer.json["analysis"];
    let shares = |task: usize| analysis["tasks"][task]["shares"].as_array().unwrap().clone();
    for (share, (votes, chosen, p)) in
        shares(0).iter().zip([(2000, 0.525, 0.0268), (1000, 0.538, 0.01766), (1000, 0.512, 0.46705)])
    {
        assert_eq!(share["n_votes"], votes);
        near(&share["share"], chosen, 1e-12);
        let test = by(&share["tests"], "binomial");
        near(&test["p"], p, 1e-4);
        assert!(test["naive"] == true && test["exploratory"] == true);
    }
    let pooled = &shares(0)[0];
    near(&by(&pooled["equivalence"], "binomial")["p"], 6.5e-12, 5e-13);
    assert!(by(&pooled["equivalence"], "binomial")["passes"] == true);
    let wilson = by(&pooled["intervals"], "wilson");
    near(&wilson["low"], 0.5031, 1e-4);
    near(&wilson["high"], 0.5468, 1e-4);
    for (share, chosen) in shares(1).iter().zip([0.65, 0.588, 0.712]) {
        near(&share["share"], chosen, 1e-12);
        assert!(by(&share["tests"], "crossed")["p"].as_f64().unwrap() < 1e-3);
        assert_eq!(share["conclusion"], "above");
    }
    assert!(analysis["notes"][0].as_str().unwrap().contains("all statistics are exploratory"), "{analysis}");
    let sentence = analysis["tasks"][0]["conclusions"][0].as_str().unwrap();
    assert!(sentence.contains("52.5 % of 2,000 votes"), "{sentence}");
    // A narrower bound.
    let answer = project.answer(&["study", "analyse", "votes.csv", "--draws", "100", "--bound", "5"]);
    let pooled = &answer.json["analysis"]["tasks"][0]["shares"][0];
    near(&by(&pooled["equivalence"], "binomial")["p"], 0.013, 5e-4);
}

#[test]
fn a_known_preference_is_found_and_reported_in_every_design() {
    let project = Project::with_clips("study-page", 0, 1.0);
    std::fs::write(project.dir().join("votes.csv"), votes_of_all_designs(60, 5)).unwrap();
    let args = ["study", "analyse", "votes.csv", "--draws", "300", "--report", "deep/page.html"];
    let answer = project.answer(&args);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let tasks = &answer.json["analysis"]["tasks"];
    let conclusion = |task: usize| tasks[task]["shares"][0]["conclusion"].as_str().unwrap_or_default().to_owned();
    assert_eq!([0, 1, 2].map(conclusion), ["below", "above", "above"], "{}", tasks[0]["conclusions"]);
    // Exact permutation of sides: the table has the side of each condition.
    assert!(by(&tasks[0]["shares"][0]["tests"], "sides")["p"].as_f64().unwrap() < 0.05);
    // The mixed model agrees, and estimates the spread of participants and clips.
    let model = &tasks[0]["shares"][0]["model"];
    assert!(model["log_odds"].as_f64().unwrap() < 0.0 && model["sd_clips"].as_f64().unwrap() < 0.5, "{model}");
    assert!(by(&tasks[0]["shares"][0]["tests"], "mixed-model")["p"].as_f64().unwrap() < 0.01);
    // Preferences: natural over good over bad, by all methods.
    for task in [3, 4] {
        for pair in tasks[task]["pairs"].as_array().unwrap() {
            let names = ["bad", "good", "natural"];
            let rank = |side: &str| names.iter().position(|name| pair[side] == *name).unwrap();
            assert_eq!(pair["difference"].as_f64().unwrap() > 0.0, rank("first") > rank("second"), "{pair}");
            assert!(by(&pair["tests"], "wilcoxon")["adjusted_p"].as_f64().unwrap() < 0.01, "{pair}");
        }
    }
    for task in [3, 4] {
        let strengths = tasks[task]["strengths"].as_array().unwrap();
        assert_eq!(
            strengths.iter().map(|row| row["condition"].as_str().unwrap()).collect::<Vec<_>>(),
            ["natural", "good", "bad"]
        );
        let [high, low] = [&strengths[0], &strengths[2]];
        assert!(high["interval"]["low"].as_f64().unwrap() > low["interval"]["high"].as_f64().unwrap());
        assert!(high["elo"].as_f64().unwrap() > 1000.0 && low["elo"].as_f64().unwrap() < 1000.0);
    }
    let scores = tasks[4]["scores"].as_array().unwrap();
    assert_eq!(
        scores.iter().map(|row| row["condition"].as_str().unwrap()).collect::<Vec<_>>(),
        ["natural", "good", "bad"]
    );
    assert!(tasks[4]["overall"]["p"].as_f64().unwrap() < 1e-6);
    assert!(tasks[4]["agreement"].as_f64().unwrap() > 0.1);
    let page = project.dir().join("deep/page.html");
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(!html.contains("://") && !html.contains(&*project.dir().to_string_lossy()));
    let again = project.answer(&args);
    assert_eq!((again.json == answer.json, std::fs::read_to_string(&page).unwrap() == html), (true, true));
    let Some(mut browser) = Browser::open(&page, [1280, 900]) else { return };
    let mut count = |selector: &str| browser.value(&format!("document.querySelectorAll('{selector}').length"));
    assert_eq!((count(".conclusion"), count(".steps")), (5.into(), 3.into()));
    assert!(count("svg.forest").as_u64().unwrap() >= 7 && count(".figures tbody tr").as_u64().unwrap() > 60);
    assert_eq!(count(".registered"), 0, "no hypothesis was registered");
    for (width, scheme) in [(360, "dark"), (360, "light"), (1280, "dark"), (1280, "light")] {
        browser.resize([width, 800]);
        browser.colours(scheme);
        let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= u64::from(width), "{wide} px wide in a window of {width} px");
    }
    assert!(browser.problems.is_empty(), "{:?}", browser.problems);
}

/// Only results of registered hypotheses are marked as not exploratory.
#[test]
fn registered_hypotheses_are_judged_and_marked() {
    let dir = tempfile::tempdir().unwrap();
    let table = dir.path().join("votes.csv");
    std::fs::write(&table, votes_of_all_designs(60, 5)).unwrap();
    let read = VotesRead::of_file(&table, &ColumnNames::default(), None).unwrap();
    let claim = |task: &str, kind, per_speaker| RegisteredHypothesis {
        claim: StudyHypothesis {
            task: task.to_owned(),
            kind,
            conditions: Vec::new(),
            per_speaker,
            points: (kind == HypothesisKind::Equivalence).then_some(5.0),
        },
        statistic: "crossed".to_owned(),
    };
    let registration = Registration {
        title: "Made up".to_owned(),
        seal: Some("5ea1".to_owned()),
        notes: Vec::new(),
        hypotheses: vec![
            claim("pick", HypothesisKind::DiffersFromChance, false),
            claim("pick", HypothesisKind::Equivalence, false),
            claim("fit", HypothesisKind::GreaterThanChance, true),
            claim("rate", HypothesisKind::Differs, false),
        ],
        exclusion: ExclusionRules {
            failed_checks: None,
            incomplete: false,
            stalled_secs: None,
            unfocused_secs: None,
            reloaded: false,
        },
        settings: AnalysisSettings::default(),
    };
    let settings = StatisticSettings { n_draws: 200, ..StatisticSettings::from(&registration.settings) };
    let analysis = analyse(["Made up", "votes.csv"], &read, Some(&registration), &settings).unwrap();
    let outcomes: Vec<Vec<(&str, Option<bool>)>> = analysis
        .hypotheses
        .iter()
        .map(|judged| judged.claims.iter().map(|claim| (claim.scope.as_str(), claim.holds)).collect())
        .collect();
    let pairs = [("natural and good", Some(true)), ("natural and bad", Some(true)), ("good and bad", Some(true))];
    assert_eq!(outcomes[0], [("all votes", Some(true))]);
    assert_eq!(outcomes[1], [("all votes", Some(false))]);
    assert_eq!(outcomes[2], [("speaker ada", Some(true)), ("speaker ben", Some(true))]);
    assert_eq!(outcomes[3], pairs);
    let marked: Vec<(&str, usize)> = analysis
        .tasks
        .iter()
        .map(|task| (task.task.as_str(), task.origins().filter(|origin| !origin.exploratory).count()))
        .collect();
    // Interval and test of each registered share, the test of equivalence, interval and test of three pairs.
    assert_eq!(marked, [("pick", 3), ("single", 0), ("fit", 4), ("prefer", 0), ("rate", 6)]);
    assert_eq!(analysis.seal.as_deref(), Some("5ea1"));
    let pooled = analysis.tasks[0].pooled().unwrap();
    assert_eq!(pooled.statistics.equivalence(StatisticMethod::Crossed).unwrap().bound, 0.05);
}

#[test]
fn participants_are_planned_from_standard_deviations() {
    let project = Project::with_clips("study-plan", 0, 1.0);
    let study = r#"
title = "Planned"
participants = 20
attention_checks = 0
practice = false
[clips]
seconds = 2.0
[[speaker]]
name = "ada"
dataset = "data"
[[condition]]
name = "natural"
kind = "natural"
[[condition]]
name = "good"
kind = "checkpoint"
checkpoint = "model"
[[task]]
name = "pick"
design = "turing"
trials = 10
"#;
    std::fs::write(project.dir().join("study.toml"), study).unwrap();
    let plan =
        ["study", "plan", "study.toml", "--clips", "30", "--simulations", "100", "--power", "0.8", "--effect", "60"];
    let answer = project.answer(&[&plan[..], &["--participant-sd", "0.5", "--clip-sd", "0.2"]].concat());
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let question = &answer.json["plan"]["question"];
    assert_eq!((&question["sd_participants"], &question["sd_clips"]), (&0.5.into(), &0.2.into()));
    let needed = answer.json["plan"]["difference"]["n_participants"].as_u64().unwrap();
    assert!((10..80).contains(&needed), "{needed}");
}

#[test]
fn damaged_tables_are_reported_by_line_without_a_panic() {
    let project = Project::with_clips("study-damaged", 0, 1.0);
    let good = counted_votes(&[("t", "turing", "s", 60, 200)]);
    let with_bad = format!("{good}p1,c1,s,t,turing,maybe\n<script>alert(1)</script>,c1,s,t,turing,2\n");
    std::fs::write(project.dir().join("bad.csv"), &with_bad).unwrap();
    let answer = project.answer(&["study", "analyse", "bad.csv", "--draws", "100", "--report", "p.html"]);
    assert_eq!(answer.code, 2, "{}", answer.errors);
    let rejected = &answer.json["analysis"]["rejected"];
    assert_eq!((&rejected[0]["line"], &rejected[1]["line"]), (&202.into(), &203.into()));
    assert!(rejected[0]["reason"].as_str().unwrap().contains("correct is \"maybe\""), "{rejected}");
    assert_eq!(answer.json["analysis"]["tasks"][0]["n_votes"], 200);
    let html = std::fs::read_to_string(project.dir().join("p.html")).unwrap();
    assert!(!html.contains("<script>alert"));
    let mut rng = Rng32(9);
    for round in 0..12 {
        let mut bytes = good.clone().into_bytes();
        for _ in 0..40 {
            let position = rng.below(bytes.len() as u32) as usize;
            match rng.below(3) {
                0 => bytes[position] = rng.below(256) as u8,
                1 => drop(bytes.remove(position)),
                _ => bytes.insert(position, b",;\"\n\xff|{"[rng.below(7) as usize]),
            }
        }
        std::fs::write(project.dir().join("fuzz.csv"), &bytes).unwrap();
        let answer = project.answer(&["study", "analyse", "fuzz.csv", "--draws", "100"]);
        assert!([0, 1, 2].contains(&answer.code) && !answer.errors.contains("panicked"), "{round}: {}", answer.errors);
    }
    std::fs::write(project.dir().join("motion.npy"), b"\x93NUMPY\x01\x00v\x00{'descr': '<f4'}\n").unwrap();
    for (args, expected) in [
        (vec!["study", "analyse", "none.csv"], "none.csv"),
        (vec!["study", "analyse", "motion.npy"], "the file is binary"),
        (vec!["study", "analyse", "bad.csv", "--columns", "who=x"], "unknown field \"who\""),
        (vec!["study", "analyse", "bad.csv", "--columns", "clip=film"], "column \"film\" not found"),
        (vec!["study", "analyse", "bad.csv", "--bound", "70"], "--bound 70:"),
        (vec!["study", "analyse", "bad.csv", "--report", "p.txt"], "ends in .html"),
    ] {
        let answer = project.answer(&args);
        assert!(answer.code == 1 && answer.errors.contains(expected), "{expected}: {}", answer.errors);
    }
}
