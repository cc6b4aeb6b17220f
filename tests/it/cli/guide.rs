//! `orator guide`, and commands whose standard output is closed.

use std::path::Path;
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
fn the_list_has_every_page_and_pages_are_printed_in_full() {
    let list = printed(&["guide"]);
    for topic in orator::guide::TOPICS {
        assert!(list.contains(topic.name) && list.contains(topic.summary), "{list}");
        assert_eq!(printed(&["guide", topic.name]).trim_end(), topic.text.trim_end());
    }
    let json: serde_json::Value = serde_json::from_str(&printed(&["--json", "guide", "dataset"])).unwrap();
    assert!(json["topic"] == "dataset" && json["text"].as_str().unwrap().starts_with("# "));
}

#[test]
fn an_unknown_page_is_an_error_that_lists_the_pages() {
    let output = orator(&["guide", "datset"]).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1));
    assert!(errors.contains("dataset") && errors.contains("architecture"), "{errors}");
}

#[test]
fn a_closed_standard_output_is_not_an_error() {
    for arguments in [&["guide", "dataset"][..], &["guide"], &["completions", "bash"], &["man"]] {
        let mut running = orator(arguments).stdout(Stdio::piped()).spawn().unwrap();
        drop(running.stdout.take());
        let output = running.wait_with_output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// The second column of the tables of statements names files and folders relative to `src`, most of them with a path.
#[test]
fn the_page_of_the_papers_names_existing_code() {
    let page = orator::guide::TOPICS.into_iter().find(|topic| topic.name == "papers").unwrap();
    let cells = page.text.lines().map(|line| line.split('|').collect::<Vec<_>>());
    let code = cells.filter(|cells| cells.len() == 7).flat_map(|cells| cells[2].split('`').skip(1).step_by(2));
    let paths: Vec<&str> = code.filter(|name| name.contains('/')).collect();
    assert!(paths.len() > 50, "{paths:?}");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let missing: Vec<_> = paths.iter().filter(|path| !source.join(path).exists()).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

/// Each `orator VERB` in the guide and README is a subcommand of the program.
#[test]
fn every_subcommand_in_the_guide_and_readme_exists() {
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
