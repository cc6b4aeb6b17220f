//! A bundle of static files, and the responses collected from its pages.

use crate::fixtures::served_study::{MadeStudy, fitting};
use orator_study::bundle::files::BundledPlan;
use serde_json::json;
use std::fs;
use std::process::Command;

#[test]
fn what_the_pages_of_a_bundle_have_sent_becomes_votes() {
    let made = MadeStudy::new(2, 2, 4, 1);
    let (dir, out) = (made.folder.dir(), made.folder.dir().join("bundle"));
    let arguments = ["study", "bundle", dir.to_str().unwrap(), "--post", "https://example.org/collect", "--out"];
    let bundled = Command::new(env!("CARGO_BIN_EXE_orator")).args(arguments).arg(&out).output().unwrap();
    assert!(bundled.status.success(), "{}", String::from_utf8_lossy(&bundled.stderr));
    let files = ["public/index.html", "places.csv", "README.md"];
    assert!(files.iter().all(|file| out.join(file).is_file()), "{files:?}");
    let plan = BundledPlan::read(&made.folder).unwrap();
    let line = |position: usize| {
        json!({
            "study": plan.study, "kind": "answer", "session": plan.sessions[1], "participant": "a".repeat(24),
            "position": position, "response": fitting(position, true), "plays": 1, "stalled_secs": 0.0,
            "unfocused_secs": 0.0, "response_secs": 1.0,
        })
    };
    let n_trials = plan.plan.sessions[1].trials.len();
    let lines: String = (0..n_trials).map(|position| format!("{}\n", line(position))).collect();
    let posts = dir.join("posts.jsonl");
    fs::write(&posts, lines + "no JSON\n").unwrap();
    let exported = Command::new(env!("CARGO_BIN_EXE_orator"))
        .args(["--json", "study", "export", dir.to_str().unwrap(), "--posts"])
        .arg(&posts)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&exported.stdout).into_owned();
    assert!(exported.status.success(), "{said} {}", String::from_utf8_lossy(&exported.stderr));
    let votes = fs::read_to_string(dir.join("export/votes.csv")).unwrap();
    assert_eq!(votes.lines().count(), 1 + n_trials, "{votes}");
    assert!(votes.lines().skip(1).all(|row| row.ends_with(",1,true")), "{votes}");
    assert!(said.contains("\"n_dropped\":1"), "{said}");
}
