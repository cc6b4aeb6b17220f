//! A folder or pipe at the path of a claim or record blocks only its own unit.

use orator_test_support::project::{Project, files_under};
use serde_json::{Value, json};
use std::fs;
use std::process::Command;

#[test]
fn a_folder_at_the_path_of_a_claim_blocks_one_unit_and_is_named() {
    let project = Project::with_clips("planted", 2, 4.6);
    assert_eq!(project.answer(&["plan"]).code, 0);
    let plan: Value = serde_json::from_slice(&fs::read(project.work().join("plan.json")).unwrap()).unwrap();
    let folder = project.work().join(format!("plan-{}", &plan["seal"].as_str().unwrap()[..12]));
    let claim = folder.join("claims/0000/000000.claim.0001");
    fs::create_dir_all(&claim).unwrap();
    let worked = project.answer(&["work", "--plan", "work/plan.json"]);
    let blocked = worked.json["blocked"].to_string();
    assert_eq!((worked.code, worked.json["done"].as_u64()), (2, Some(1)), "{}", worked.errors);
    assert!(blocked.contains("000000.claim.0001"), "{blocked}");
    let status = project.answer(&["status", "--plan", "work/plan.json"]);
    assert_eq!((status.code, &status.json["n_done"]), (0, &json!(1)), "{}", status.errors);
    assert_eq!(status.json["blocked"].as_array().unwrap().len(), 1, "{}", status.json);
    fs::remove_dir(claim).unwrap();
    let worked = project.answer(&["work", "--plan", "work/plan.json"]);
    assert_eq!((worked.code, worked.json["done"].as_u64()), (0, Some(1)), "{}", worked.errors);
}

#[test]
fn a_pipe_or_folder_at_the_path_of_a_record_does_not_block_a_run() {
    let project = Project::with_clips("records", 2, 1.0);
    assert_eq!(project.run(&["--to", "extract"]).code, 0);
    let files = files_under(&project.work().join("extract"));
    let records: Vec<_> = files.into_iter().filter(|(name, _)| name.ends_with(".record.json")).collect();
    assert_eq!(records.len(), 2);
    records.iter().for_each(|(_, path)| fs::remove_file(path).unwrap());
    assert!(Command::new("mkfifo").arg(&records[0].1).status().unwrap().success());
    fs::create_dir(&records[1].1).unwrap();
    assert_eq!(project.answer(&["status"]).code, 0);
    let run = project.run(&["--to", "extract"]);
    assert_eq!((run.code, &run.json["stages"]["extract"]["done"]), (2, &json!(1)), "{}", run.errors);
    let name = records[1].1.file_name().unwrap().to_str().unwrap();
    assert!(run.json["failures"].to_string().contains(name), "{}", run.json);
}
