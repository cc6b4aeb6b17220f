//! A plan is bound to the content of its videos: a changed video is not processed, a missing one is reported, and
//! forgetting a video removes the plan.

use orator_test_support::project::{Project, files_under};
use std::fs;
use std::path::Path;

const WORK: [&str; 3] = ["work", "--plan", "work/plan.json"];

fn file_name(path: &Path) -> &str {
    path.file_name().unwrap().to_str().unwrap()
}

#[test]
fn a_video_changed_since_the_plan_is_not_processed_and_is_reported() {
    let project = Project::with_clips("sealed", 2, 4.6);
    let clips = project.clips();
    let (name, original) = (file_name(&clips[0]), fs::read(&clips[0]).unwrap());
    let plan = project.answer(&["plan"]);
    assert_eq!(plan.code, 0, "{}", plan.errors);
    fs::copy(&clips[1], &clips[0]).unwrap();
    let worked = project.answer(&WORK);
    assert_eq!((worked.code, worked.json["done"].as_u64()), (2, Some(1)), "{}", worked.errors);
    let failed = worked.json["failed"].to_string();
    assert!(failed.contains(&format!("{name} changed since the plan")) && failed.contains("`orator plan`"), "{failed}");
    let stem = clips[0].file_stem().unwrap().to_str().unwrap().replace('_', "-");
    let is_changed = |name: &str| name.contains(&format!("/{stem}-"));
    assert!(!files_under(&project.work().join("extract")).iter().any(|(name, _)| is_changed(name)), "it was processed");

    // Restored with another modification time: a dataset without the video fails, and a retry processes it.
    fs::write(&clips[0], original).unwrap();
    let incomplete = project.run(&["--only", "dataset"]);
    let failures = incomplete.json["failures"].to_string();
    assert!(incomplete.code == 2 && failures.contains(&format!("host/{stem}-")), "{failures} {}", incomplete.errors);
    let retried = project.answer(&[&WORK[..], &["--retry"]].concat());
    assert_eq!((retried.code, retried.json["done"].as_u64()), (0, Some(1)), "{}", retried.errors);
    assert_eq!(project.run(&["--only", "dataset"]).code, 0);

    fs::remove_file(&clips[1]).unwrap();
    let missing = project.run(&["--only", "dataset"]);
    let failures = missing.json["failures"].to_string();
    assert!(
        missing.code == 2 && failures.contains(file_name(&clips[1])) && failures.contains("does not exist"),
        "{failures}"
    );
}

#[test]
fn forgetting_a_video_removes_its_plan() {
    let project = Project::with_clips("planned", 2, 1.0);
    assert_eq!(project.answer(&["plan"]).code, 0);
    let clips = project.clips();
    let plan: serde_json::Value = serde_json::from_slice(&fs::read(project.work().join("plan.json")).unwrap()).unwrap();
    let workers = project.work().join(format!("plan-{}", &plan["seal"].as_str().unwrap()[..12])).join("workers");
    fs::create_dir_all(&workers).unwrap();
    fs::write(workers.join("dead-1.json"), clips[0].to_str().unwrap()).unwrap();
    let forgotten = project.answer(&["forget", "--video", file_name(&clips[0])]);
    assert_eq!(forgotten.code, 0, "{} {}", forgotten.json, forgotten.errors);
    assert!(forgotten.json["found"].as_array().unwrap().is_empty());
    assert!(forgotten.json["advice"].to_string().contains("run `orator plan` again"), "{}", forgotten.json);
    let remaining = files_under(&project.work()).into_iter().filter(|(name, _)| name.starts_with("plan"));
    assert_eq!(remaining.count(), 0);
    let rejected = project.answer(&WORK);
    assert!(rejected.code == 1 && rejected.errors.contains("create one with `orator plan`"), "{}", rejected.errors);
}
