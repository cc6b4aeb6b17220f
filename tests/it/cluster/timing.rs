//! `orator plan` says what the work takes, and a run how far that was off.

use orator_test_support::project::Project;
use serde_json::json;

#[test]
fn a_plan_says_what_the_work_takes_and_a_run_what_it_took() {
    let project = Project::with_clips("timed", 3, 5.0);
    let untimed = project.answer(&["plan", "--untimed"]);
    assert_eq!((untimed.code, untimed.json.get("stages")), (0, None), "{}", untimed.errors);
    let plan = project.answer(&["plan", "--workers", "3", "--hours", "100"]);
    assert_eq!((plan.code, &plan.json["workers_needed"]), (0, &json!(1)), "{}", plan.errors);
    let secs = |stage: &str| plan.json["stages"][stage]["work_secs"].as_f64().unwrap();
    assert!(secs("pose2d") > secs("segment") && secs("extract") > 0.0, "{}", plan.json);
    assert!(plan.json["stages"]["pose2d"]["bytes"].as_f64().unwrap() > 1000.0);
    let wall = |n: &str| plan.json["wall_secs"][n].as_f64().unwrap();
    assert!(wall("3") < wall("1") && plan.json["peak_mib"].as_f64().unwrap() > 10.0, "{}", plan.json);
    assert!(!project.work().join("timing").exists());
    // What is known is not timed again.
    let file = project.work().join("stage_times.json");
    let known = std::fs::read(&file).unwrap();
    assert_eq!(project.answer(&["plan"]).code, 0);
    assert_eq!(std::fs::read(&file).unwrap(), known);
    // Within half and twice: other tests may be at work beside this one.
    let run = project.answer(&["run"]);
    let (planned, took) = (&run.json["planned_work_secs"], run.json["work_secs"].as_f64().unwrap());
    let off = took / planned.as_f64().unwrap();
    assert!(run.code == 0 && (0.2..5.0).contains(&off), "{planned} s planned, {took} s");
    // What an earlier run has left of a unit is less work than was planned, and is not held against the plan.
    let again = ["run", "--only", "pose2d", "--force"];
    assert!(project.answer(&again).json["planned_work_secs"].as_f64().is_some_and(|planned| planned > 0.0));
    for unit in std::fs::read_dir(project.work().join("pose2d/host")).unwrap() {
        let unit = unit.unwrap().path();
        if unit.is_dir() {
            std::fs::create_dir(unit.with_file_name(format!("{}.parts", unit.file_name().unwrap().display()))).unwrap();
        }
    }
    assert_eq!(project.answer(&again).json["planned_work_secs"], json!(null));
    assert_eq!(project.answer(&["run", "--set", "pose2d.person_every=6"]).json["planned_work_secs"], json!(null));
}
