//! Names of public items, files, flags, configuration and JSON keys consist of the words in `vocabulary.txt`. Its last
//! part lists keys of data files, which keep their names.

use crate::fixtures::sources::{rust_files, scan, without_tests};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Words of `snake_case`, `CamelCase` and `kebab-case` names in lower case; single letters and digits are no words.
fn words(name: &str) -> Vec<String> {
    let chars: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (k, c) in chars.iter().enumerate() {
        let next_is_lower = chars.get(k + 1).is_some_and(|next| next.is_lowercase());
        let begins = c.is_uppercase() && k > 0 && (chars[k - 1].is_lowercase() || next_is_lower);
        if begins || !c.is_alphabetic() {
            words.push(String::new());
        }
        if c.is_alphabetic() {
            words.last_mut().unwrap().extend(c.to_lowercase());
        }
    }
    words.retain(|word| word.len() > 1);
    words
}

fn identifier(text: &str) -> Option<String> {
    let name: String = text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    (!name.is_empty()).then_some(name)
}

/// Names of public items, of all struct fields and of enum variants; `code` is without comments and strings.
fn declared(code: &str) -> Vec<String> {
    let (mut names, mut body) = (Vec::new(), None);
    for line in code.lines() {
        let text = line.trim_start();
        let indent = line.len() - text.len();
        let public = text.strip_prefix("pub ").or_else(|| {
            let (scope, rest) = text.strip_prefix("pub(")?.split_once(") ")?;
            (!scope.contains('(')).then_some(rest)
        });
        let item = public.unwrap_or(text);
        let kinds =
            ["const fn", "unsafe fn", "async fn", "fn", "struct", "enum", "const", "trait", "type", "static", "mod"];
        let kind = kinds.iter().find_map(|kind| Some((*kind, item.strip_prefix(kind)?.strip_prefix(' ')?)));
        match kind {
            Some((kind, rest)) => {
                names.extend(public.and(identifier(rest)));
                if ["struct", "enum"].contains(&kind) && line.ends_with('{') {
                    body = Some((kind, indent));
                }
            }
            None if text.starts_with('}') && body.is_some_and(|(_, of)| of == indent) => body = None,
            None => match body {
                Some(("struct", of)) if indent == of + 4 && item.contains(": ") => names.extend(identifier(item)),
                Some(("enum", of)) if indent == of + 4 && text.starts_with(char::is_uppercase) => {
                    names.extend(identifier(text));
                }
                _ => {}
            },
        }
    }
    names
}

/// Keys in `json!` and `["key"]`, renamed serde keys, and keys of `section!`.
fn keys(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
        let parts: Vec<&str> = line.split('"').collect();
        for k in (1..parts.len()).step_by(2) {
            let (before, after) = (parts[k - 1].trim_end(), parts.get(k + 1).copied().unwrap_or_default());
            let is_key = (before.ends_with('[') && after.starts_with(']'))
                || (after.starts_with(':') && !after.starts_with("::"))
                || before.ends_with("rename =");
            let is_name = parts[k].chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "_-".contains(c));
            names.extend((is_key && is_name).then(|| parts[k].to_owned()));
        }
    }
    names
}

/// Long flags of all verbs, as the shell completion lists them.
fn flags() -> BTreeSet<String> {
    let of = |program: &Path, args: &[&str]| {
        let output = Command::new(program).args(args).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        let flag = |word: &str| identifier(&word.trim_start_matches('"').strip_prefix("--")?.replace('-', "_"));
        text.split_whitespace().filter_map(flag).collect()
    };
    of(Path::new(env!("CARGO_BIN_EXE_orator")), &["completions", "bash"])
}

/// Names with the file that declares them.
fn names() -> BTreeMap<String, String> {
    let mut names: BTreeMap<String, String> = flags().into_iter().map(|flag| (flag, "a flag".to_owned())).collect();
    let mut add = |name: String, place: &Path| {
        names.entry(name).or_insert_with(|| place.strip_prefix(root()).unwrap().display().to_string());
    };
    for file in rust_files(&root().join("src")) {
        let all = fs::read_to_string(&file).unwrap();
        let text = without_tests(&all);
        declared(&scan(text).0).into_iter().for_each(|name| add(name, &file));
        keys(text).into_iter().for_each(|name| add(name, &file));
        add(file.file_stem().unwrap().to_str().unwrap().to_owned(), &file);
        add(file.parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned(), &file);
    }
    for file in rust_files(&root().join("tests/it")) {
        add(file.file_stem().unwrap().to_str().unwrap().to_owned(), &file);
    }
    let configuration = root().join("pipeline.toml");
    for line in fs::read_to_string(&configuration).unwrap().lines() {
        if let Some((key, _)) = line.split_once(" = ").filter(|(key, _)| !key.starts_with('#')) {
            add(key.to_owned(), &configuration);
        }
    }
    names
}

#[test]
fn names_consist_of_words_of_the_vocabulary() {
    let list = fs::read_to_string(root().join("tests/it/vocabulary.txt")).unwrap();
    let mut parts = list.split("\n# ").map(|part| part.lines().skip(1).flat_map(str::split_whitespace).collect());
    let (vocabulary, exact): (BTreeSet<&str>, BTreeSet<&str>) = (parts.next().unwrap(), parts.next().unwrap());
    let names = names();
    let used: BTreeSet<String> = names.keys().flat_map(|name| words(name)).collect();
    let unused: Vec<_> = vocabulary.iter().filter(|word| !used.contains(**word)).collect();
    let gone: Vec<_> = exact.iter().filter(|name| !names.contains_key(**name)).collect();
    let unknown: Vec<String> = names
        .iter()
        .filter(|(name, _)| !exact.contains(name.as_str()))
        .filter_map(|(name, place)| {
            let word = words(name).into_iter().find(|word| !vocabulary.contains(word.as_str()))?;
            Some(format!("{name} ({place}): {word}"))
        })
        .collect();
    assert!(unknown.is_empty(), "{} names:\n{}", unknown.len(), unknown.join("\n"));
    assert!(unused.is_empty() && gone.is_empty(), "words without a name: {unused:?} {gone:?}");
}
