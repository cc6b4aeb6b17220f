//! A plan covers the content of its videos: one that changed is not worked on, none is missing silently, and a forgotten one
//! takes the plan with it.

use orator_test_support::project::{Project, files_under};
use std::fs;
use std::path::Path;

const WORK: [&str; 3] = ["work", "--plan", "work/plan.json"];

fn file_name(path: &Path) -> &str {
    path.file_name().unwrap().to_str().unwrap()
}

#[test]
fn a_video_that_changed_since_the_plan_is_not_worked_on_and_never_left_out_silently() {
    let project = Project::with_clips("sealed", 2, 4.6);
    let clips = project.clips();
    let (name, original) = (file_name(&clips[0]), fs::read(&clips[0]).unwrap());
    let plan = project.answer(&["plan", "--no-timing"]);
    assert_eq!(plan.code, 0, "{}", plan.errors);
    fs::copy(&clips[1], &clips[0]).unwrap();
    let worked = project.answer(&WORK);
    assert_eq!((worked.code, worked.json["done"].as_u64()), (2, Some(1)), "{}", worked.errors);
    let failed = worked.json["failed"].to_string();
    assert!(failed.contains(&format!("{name} changed since the plan")) && failed.contains("`orator plan`"), "{failed}");
    let stem = clips[0].file_stem().unwrap().to_str().unwrap().replace('_', "-");
    let is_of = |name: &str| name.contains(&format!("/{stem}-"));
    assert!(!files_under(&project.work().join("extract")).iter().any(|(name, _)| is_of(name)), "it was worked on");

    // Changed back, with another time: the dataset without it is no success, and a retry works on it.
    fs::write(&clips[0], original).unwrap();
    let left_out = project.run(&["--only", "dataset"]);
    let failures = left_out.json["failures"].to_string();
    assert!(left_out.code == 2 && failures.contains(&format!("host/{stem}-")), "{failures} {}", left_out.errors);
    let retried = project.answer(&[&WORK[..], &["--retry"]].concat());
    assert_eq!((retried.code, retried.json["done"].as_u64()), (0, Some(1)), "{}", retried.errors);
    assert_eq!(project.run(&["--only", "dataset"]).code, 0);

    fs::remove_file(&clips[1]).unwrap();
    let gone = project.run(&["--only", "dataset"]);
    let failures = gone.json["failures"].to_string();
    assert!(
        gone.code == 2 && failures.contains(file_name(&clips[1])) && failures.contains("does not exist"),
        "{failures}"
    );
}

#[test]
fn a_plan_goes_with_a_forgotten_video() {
    let project = Project::with_clips("planned", 2, 1.0);
    assert_eq!(project.answer(&["plan", "--no-timing"]).code, 0);
    let clips = project.clips();
    let plan: serde_json::Value = serde_json::from_slice(&fs::read(project.work().join("plan.json")).unwrap()).unwrap();
    let workers = project.work().join(format!("plan-{}", &plan["seal"].as_str().unwrap()[..12])).join("workers");
    fs::create_dir_all(&workers).unwrap();
    fs::write(workers.join("dead-1.json"), clips[0].to_str().unwrap()).unwrap();
    let forgotten = project.answer(&["forget", "--video", file_name(&clips[0])]);
    assert_eq!(forgotten.code, 0, "{} {}", forgotten.json, forgotten.errors);
    assert!(forgotten.json["found"].as_array().unwrap().is_empty());
    assert!(forgotten.json["advice"].to_string().contains("run `orator plan` again"), "{}", forgotten.json);
    let left = files_under(&project.work()).into_iter().filter(|(name, _)| name.starts_with("plan"));
    assert_eq!(left.count(), 0);
    let refused = project.answer(&WORK);
    assert!(refused.code == 1 && refused.errors.contains("create one with `orator plan`"), "{}", refused.errors);
}
