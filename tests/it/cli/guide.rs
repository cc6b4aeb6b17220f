//! What the program says of itself: `orator guide`, and a standard output that nobody reads.

use std::process::{Command, Stdio};

fn orator(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(arguments).stdin(Stdio::null()).stderr(Stdio::piped());
    command
}

fn printed(arguments: &[&str]) -> String {
    let output = orator(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_list_names_every_page_and_every_page_is_printed_whole() {
    let list = printed(&["guide"]);
    for topic in orator::guide::TOPICS {
        assert!(list.contains(topic.name) && list.contains(topic.summary), "{list}");
        assert_eq!(printed(&["guide", topic.name]).trim_end(), topic.text.trim_end());
    }
    let json: serde_json::Value = serde_json::from_str(&printed(&["--json", "guide", "dataset"])).unwrap();
    assert!(json["topic"] == "dataset" && json["text"].as_str().unwrap().starts_with("# "));
}

#[test]
fn a_page_that_does_not_exist_is_refused_with_those_that_do() {
    let output = orator(&["guide", "datset"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains("dataset") && said.contains("architecture"), "{said}");
}

#[test]
fn a_closed_standard_output_is_no_failure() {
    for arguments in [&["guide", "dataset"][..], &["guide"], &["completions", "bash"], &["man"]] {
        let mut running = orator(arguments).stdout(Stdio::piped()).spawn().unwrap();
        drop(running.stdout.take());
        let output = running.wait_with_output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// The verbs that the guide and README show exist: each `orator VERB` in them has a help text.
#[test]
fn every_verb_in_the_texts_exists() {
    let readme = include_str!("../../../README.md");
    let texts = orator::guide::TOPICS.map(|topic| topic.text).join("\n") + readme;
    let words: Vec<&str> = texts.split(|c: char| c.is_whitespace() || c == '`').collect();
    let is_verb = |word: &&str| word.chars().all(|c| c.is_ascii_lowercase()) && word.len() > 2;
    let mut verbs: Vec<&str> =
        words.windows(2).filter(|pair| pair[0].ends_with("orator")).map(|pair| pair[1]).filter(is_verb).collect();
    verbs.sort_unstable();
    verbs.dedup();
    assert!(verbs.len() > 15, "{verbs:?}");
    let known = printed(&["--help"]);
    for verb in verbs {
        assert!(known.lines().any(|line| line.split_whitespace().next() == Some(verb)), "no verb {verb}");
    }
}
