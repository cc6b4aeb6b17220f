//! `orator plan` estimates the time of the work, close to the time of a run.

use orator_test_support::project::Project;
use serde_json::json;

#[test]
fn a_plan_predicts_the_time_of_a_run() {
    let project = Project::with_clips("timed", 3, 5.0);
    let untimed = project.answer(&["plan", "--no-timing"]);
    assert_eq!((untimed.code, untimed.json.get("stages")), (0, None), "{}", untimed.errors);
    let plan = project.answer(&["plan", "--workers", "3", "--hours", "100"]);
    assert_eq!((plan.code, &plan.json["workers_needed"]), (0, &json!(1)), "{}", plan.errors);
    let secs = |stage: &str| plan.json["stages"][stage]["work_secs"].as_f64().unwrap();
    assert!(secs("pose2d") > secs("segment") && secs("extract") > 0.0, "{}", plan.json);
    assert!(plan.json["stages"]["pose2d"]["bytes"].as_f64().unwrap() > 1000.0);
    let wall = |n: &str| plan.json["wall_secs"][n].as_f64().unwrap();
    assert!(wall("3") < wall("1") && plan.json["peak_mib"].as_f64().unwrap() > 10.0, "{}", plan.json);
    assert!(!project.work().join("timing").exists());
    // Known times are not measured again.
    let file = project.work().join("stage_times.json");
    let known = std::fs::read(&file).unwrap();
    assert_eq!(project.answer(&["plan"]).code, 0);
    assert_eq!(std::fs::read(&file).unwrap(), known);
    // Within a factor of five: other tests may run at the same time.
    let run = project.answer(&["run"]);
    let planned: f64 = plan.json["stages"].as_object().unwrap().keys().map(|stage| secs(stage)).sum();
    let measured = run.json["work_secs"].as_f64().unwrap();
    assert!(run.code == 0 && (0.2..5.0).contains(&(measured / planned)), "{planned} s planned, {measured} s");
}
