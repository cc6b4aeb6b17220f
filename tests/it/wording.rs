//! Rules of the texts: length of a file, its `//!`, the first words of a doc comment, and no reference to anything
//! outside the repository.

use crate::fixtures::sources::rust_files;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Path below the repository, and text.
fn read(path: &Path) -> Option<(String, String)> {
    let name = path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned();
    Some((name, fs::read_to_string(path).ok()?))
}

fn rust_texts() -> Vec<(String, String)> {
    let files = ["src", "tests"].into_iter().flat_map(|folder| rust_files(&root().join(folder)));
    files.filter_map(|file| read(&file)).collect()
}

/// Texts of every kind that belong to the repository, this file left out.
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

fn none(wrong: &[String]) {
    assert!(wrong.is_empty(), "{} places:\n{}", wrong.len(), wrong.join("\n"));
}

/// Lines of all `texts` that `is_wrong`, with their place.
fn lines(texts: Vec<(String, String)>, is_wrong: impl Fn(&str) -> bool) -> Vec<String> {
    let place = |name: &str, (k, line): (usize, &str)| format!("{name}:{}: {}", k + 1, line.trim());
    let of_text = |(name, text): (String, String)| {
        let wrong = text.lines().enumerate().filter(|(_, line)| is_wrong(line));
        wrong.map(|line| place(&name, line)).collect::<Vec<_>>()
    };
    texts.into_iter().flat_map(of_text).collect()
}

#[test]
fn no_file_is_longer_than_400_lines() {
    let long = rust_texts().into_iter().filter(|(_, text)| text.lines().count() > 400);
    none(&long.map(|(name, _)| name).collect::<Vec<_>>());
}

#[test]
fn every_file_begins_with_what_lives_in_it_in_six_lines() {
    let texts = rust_texts();
    let silent = texts.iter().filter(|(_, text)| !text.starts_with("//!")).map(|(name, _)| name.clone());
    none(&silent.collect::<Vec<_>>());
    let head = |text: &str| text.lines().take_while(|line| line.starts_with("//!")).count();
    // The map of the workspace and the table of threads are longer.
    let longer = ["src/lib.rs", "src/nn/cpu/mod.rs"];
    let long = texts.iter().filter(|(name, text)| head(text) > 6 && !longer.contains(&name.as_str()));
    none(&long.map(|(name, _)| name.clone()).collect::<Vec<_>>());
}

#[test]
fn a_doc_comment_stands_by_itself() {
    let mut wrong = Vec::new();
    for (name, text) in rust_texts() {
        let mut inside = false;
        for (k, line) in text.lines().enumerate() {
            let doc = line.trim_start().strip_prefix("///").or_else(|| line.strip_prefix("//!"));
            let words = doc.unwrap_or_default().trim_start();
            if !inside && ["The same", "As above", "It "].iter().any(|start| words.starts_with(start)) {
                wrong.push(format!("{name}:{}: {words}", k + 1));
            }
            inside = doc.is_some();
        }
    }
    none(&wrong);
}

#[test]
fn words_are_those_of_the_field() {
    let invented = ["whither", "thither", "strewn", "liker"];
    let is_word = |word: &str| invented.contains(&word.to_lowercase().as_str());
    none(&lines(all_texts(), |line| line.split(|c: char| !c.is_alphabetic()).any(is_word)));
}

#[test]
fn nothing_refers_outside_the_repository() {
    let names = ["../shared", "rebol.md", "finemotion.md", "field.md", "house.md", "house-2.md", "lifter-targets.md"];
    let hash_after_commit = |line: &str| {
        let mut words = line.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
        let is_hash = |word: &str| word.len() >= 7 && word.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f'));
        let after = words.by_ref().skip_while(|word| !word.eq_ignore_ascii_case("commit"));
        after.skip(1).take(1).any(is_hash)
    };
    let refers = |line: &str| names.iter().any(|name| line.contains(name)) || hash_after_commit(line);
    // `commit` is a key of the manifest: where a model of others comes from.
    let texts = all_texts().into_iter().filter(|(name, _)| name != "models/manifest.toml").collect();
    none(&lines(texts, refers));
}
