//! Rules of the texts: length of a file, its `//!`, the first words of a doc comment, and no reference to anything
//! outside the repository.

use crate::fixtures::sources::rust_files;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Path relative to the repository, and text.
fn read(path: &Path) -> Option<(String, String)> {
    let name = path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned();
    Some((name, fs::read_to_string(path).ok()?))
}

fn rust_texts() -> Vec<(String, String)> {
    let files = ["src", "tests"].into_iter().flat_map(|folder| rust_files(&root().join(folder)));
    files.filter_map(|file| read(&file)).collect()
}

/// All text files of the repository except this one.
fn all_texts() -> Vec<(String, String)> {
    let folders = ["src", "tests", "models", "fixtures"];
    let mut paths: Vec<PathBuf> = ["README.md", "CHANGELOG.md", "Makefile", "pipeline.toml", "Cargo.toml"]
        .into_iter()
        .map(|name| root().join(name))
        .collect();
    let mut waiting: Vec<PathBuf> = folders.into_iter().map(|name| root().join(name)).collect();
    while let Some(folder) = waiting.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { waiting.push(path) } else { paths.push(path) }
        }
    }
    let this = file!();
    paths.iter().filter_map(|path| read(path)).filter(|(name, _)| !this.ends_with(name.as_str())).collect()
}

fn assert_none(violations: &[String]) {
    assert!(violations.is_empty(), "{} places:\n{}", violations.len(), violations.join("\n"));
}

/// Lines of `texts` for which `is_violation` holds, with file and line number.
fn lines(texts: Vec<(String, String)>, is_violation: impl Fn(&str) -> bool) -> Vec<String> {
    let located = |name: &str, (k, line): (usize, &str)| format!("{name}:{}: {}", k + 1, line.trim());
    let of_text = |(name, text): (String, String)| {
        let violations = text.lines().enumerate().filter(|(_, line)| is_violation(line));
        violations.map(|line| located(&name, line)).collect::<Vec<_>>()
    };
    texts.into_iter().flat_map(of_text).collect()
}

#[test]
fn no_file_is_longer_than_400_lines() {
    let long = rust_texts().into_iter().filter(|(_, text)| text.lines().count() > 400);
    assert_none(&long.map(|(name, _)| name).collect::<Vec<_>>());
}

#[test]
fn every_file_begins_with_a_description_of_at_most_six_lines() {
    let texts = rust_texts();
    let without_head = texts.iter().filter(|(_, text)| !text.starts_with("//!")).map(|(name, _)| name.clone());
    assert_none(&without_head.collect::<Vec<_>>());
    let head = |text: &str| text.lines().take_while(|line| line.starts_with("//!")).count();
    // The map of the workspace and the table of threads are longer.
    let longer = ["src/lib.rs", "src/nn/cpu/mod.rs"];
    let long = texts.iter().filter(|(name, text)| head(text) > 6 && !longer.contains(&name.as_str()));
    assert_none(&long.map(|(name, _)| name.clone()).collect::<Vec<_>>());
}

#[test]
fn a_doc_comment_is_self_contained() {
    let mut violations = Vec::new();
    for (name, text) in rust_texts() {
        let mut inside = false;
        for (k, line) in text.lines().enumerate() {
            let doc = line.trim_start().strip_prefix("///").or_else(|| line.strip_prefix("//!"));
            let words = doc.unwrap_or_default().trim_start();
            if !inside && ["The same", "As above", "It "].iter().any(|start| words.starts_with(start)) {
                violations.push(format!("{name}:{}: {words}", k + 1));
            }
            inside = doc.is_some();
        }
    }
    assert_none(&violations);
}

/// Phrases of an earlier style, each with what is written instead.
const PHRASES: [(&str, &str); 40] = [
    ("by heart", "overfit, memorise"),
    ("had no say", "are ignored"),
    ("has no say", "is ignored"),
    ("have no say", "are ignored"),
    ("told by", "detected by"),
    ("told apart", "distinguished"),
    ("is told", "is detected, is reported"),
    ("are told", "are detected, are reported"),
    ("was told", "was detected, was reported"),
    ("is said of", "is reported of"),
    ("stands still", "is static"),
    ("stand still", "are static"),
    ("voice of another", "off-screen speaker"),
    ("begins with a model", "is initialised from a model"),
    ("what became of", "the use of"),
    ("made anew", "rebuilt"),
    ("written anew", "written again"),
    ("begin anew", "restart"),
    ("learnt", "trained, learned"),
    ("} is no ", "{} is not a, invalid"),
    ("laid aside", "discarded"),
    ("in the hands of", "claimed by"),
    ("nobody may", "no process may"),
    ("somebody", "a person"),
    ("foretell", "predict"),
    ("an affair of", "the responsibility of"),
    ("cannot be had", "is not available"),
    ("can be had", "is available"),
    ("will do instead", "is used instead"),
    ("goes on from", "resumes from"),
    ("going on from", "resuming from"),
    ("things wrong", "problems"),
    ("not sound:", "invalid:"),
    ("frames a second", "frames per second"),
    ("steps a second", "steps per second"),
    ("the most that", "at most, the limit"),
    ("whither", "where"),
    ("thither", "there"),
    ("strewn", "scattered"),
    ("who speaks among", "the speaking person of"),
];

/// Files with texts that data files and hashes of metrics contain already.
const STORED: [&str; 6] = [
    "src/base/stage/rejection.rs",
    "src/dataset/card.rs",
    "src/gesture/metrics/",
    "src/pipeline/speech/speech_rule.rs",
    "tests/it/segment/voices.rs",
    "fixtures/",
];

#[test]
fn phrases_of_the_earlier_style_are_gone() {
    let texts = all_texts().into_iter().filter(|(name, _)| !STORED.iter().any(|stored| name.starts_with(stored)));
    let wrong = lines(texts.collect(), |line| {
        let words = format!(" {}", line.to_lowercase().replace('_', " "));
        PHRASES
            .iter()
            .any(|(phrase, _)| words.contains(&format!(" {phrase}")) || words.contains(&format!("\"{phrase}")))
    });
    assert_none(&wrong);
}

#[test]
fn no_text_refers_outside_the_repository() {
    let names = ["../shared", "rebol.md", "finemotion.md", "field.md", "house.md", "house-2.md", "lifter-targets.md"];
    let hash_after_commit = |line: &str| {
        let mut words = line.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
        let is_hash = |word: &str| word.len() >= 7 && word.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f'));
        let after = words.by_ref().skip_while(|word| !word.eq_ignore_ascii_case("commit"));
        after.skip(1).take(1).any(is_hash)
    };
    let refers = |line: &str| names.iter().any(|name| line.contains(name)) || hash_after_commit(line);
    // `commit` is a key of the manifest: the source of a third-party model.
    let texts = all_texts().into_iter().filter(|(name, _)| name != "models/manifest.toml").collect();
    assert_none(&lines(texts, refers));
}
