//! Rules of the source tree that Cargo cannot check: which crate owns a foreign library, where unsafe code is, and how
//! files and types are divided. The layers themselves are the dependencies in the manifests of the crates.

use crate::fixtures::sources::{rust_files, scan, tokens, without_comments, without_tests};
use orator_base::stage::refusal::Refusal;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules of a crate that must not import each other.
const SIBLINGS: [(&str, &[&str]); 2] = [
    ("src/pipeline", &["extract", "pose2d", "segment", "lift", "dataset"]),
    ("src/media", &["ffmpeg", "opencv", "aligner"]),
];

/// Crates whose code is not part of the product.
const NOT_PRODUCT: [&str; 2] = ["src/lab/", "src/test-support/"];

/// Names that several types may carry.
const COMMON_NAMES: [&str; 3] = ["Args", "Config", "Cli"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Rust files of `src` and `tests` with their path below the repository and their text.
fn rust_texts() -> Vec<(String, String)> {
    let files = ["src", "tests"].into_iter().flat_map(|folder| rust_files(&root().join(folder)));
    files.map(|file| (below_root(&file), fs::read_to_string(&file).unwrap())).collect()
}

fn below_root(file: &Path) -> String {
    file.strip_prefix(root()).unwrap().to_str().unwrap().to_owned()
}

fn none(wrong: &[String]) {
    assert!(wrong.is_empty(), "{} places:\n{}", wrong.len(), wrong.join("\n"));
}

/// Manifests of the root package and of all members: path below the repository, and the names of its dependencies.
fn manifests() -> Vec<(String, BTreeSet<String>)> {
    let members = fs::read_dir(root().join("src")).unwrap().map(|entry| entry.unwrap().path().join("Cargo.toml"));
    let files = std::iter::once(root().join("Cargo.toml")).chain(members).filter(|file| file.is_file());
    let read = |file: PathBuf| {
        let manifest: toml::Table = fs::read_to_string(&file).unwrap().parse().unwrap();
        let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table);
        (below_root(&file), dependencies.into_iter().flat_map(toml::Table::keys).cloned().collect())
    };
    files.map(read).collect()
}

#[test]
fn foreign_libraries_have_one_owner_each() {
    let owners = [
        ("ffmpeg-next", "src/media/Cargo.toml"),
        ("opencv", "src/media/Cargo.toml"),
        ("ort", "src/onnx/Cargo.toml"),
        ("indicatif", "Cargo.toml"),
        ("axum", "src/study/Cargo.toml"),
        ("rusqlite", "src/study/Cargo.toml"),
    ];
    let manifests = manifests();
    assert!(manifests.len() >= 11, "{manifests:?}");
    let mut wrong = Vec::new();
    for (manifest, dependencies) in &manifests {
        let foreign = owners.iter().filter(|(library, owner)| dependencies.contains(*library) && owner != manifest);
        wrong.extend(foreign.map(|(library, owner)| format!("{manifest} names {library}, which belongs to {owner}")));
    }
    none(&wrong);
}

#[test]
fn no_product_crate_depends_on_the_lab_or_on_test_support() {
    let apart = ["orator-lab", "orator-test-support"];
    let product =
        manifests().into_iter().filter(|(name, _)| !NOT_PRODUCT.iter().any(|folder| name.starts_with(folder)));
    let wrong = product.filter(|(_, dependencies)| apart.iter().any(|name| dependencies.contains(*name)));
    none(&wrong.map(|(name, _)| name).collect::<Vec<_>>());
}

#[test]
fn only_the_command_line_prints() {
    let mut wrong = Vec::new();
    for (name, text) in rust_texts().into_iter().filter(|(name, _)| name.starts_with("src/") && !name.contains("/cli/"))
    {
        let tokens = tokens(without_tests(&without_comments(&text)));
        if tokens.windows(2).any(|pair| ["print", "println"].contains(&pair[0].as_str()) && pair[1] == "!") {
            wrong.push(name);
        }
    }
    none(&wrong);
}

#[test]
fn siblings_do_not_import_each_other() {
    let mut wrong = Vec::new();
    for (name, text) in rust_texts() {
        let code = without_comments(&text);
        let code = without_tests(&code);
        for (folder, siblings) in SIBLINGS {
            let sibling = name.strip_prefix(folder).and_then(|rest| rest[1..].split('/').next());
            let Some(here) = sibling.filter(|here| siblings.contains(here)) else { continue };
            let others = siblings.iter().filter(|other| **other != here);
            let imported = others.filter(|other| code.contains(&format!("crate::{other}::")));
            wrong.extend(imported.map(|other| format!("{name} imports {other}")));
        }
        if name.starts_with("src/report/html/") && code.replace("crate::html::", "").contains("crate::") {
            wrong.push(format!("{name} imports from outside of html"));
        }
    }
    none(&wrong);
}

#[test]
fn a_folder_holds_at_most_16_files_and_its_map_no_code() {
    let mut wrong = Vec::new();
    let mut n_files: BTreeMap<String, usize> = BTreeMap::new();
    for (name, text) in rust_texts() {
        let Some((folder, file)) = name.rsplit_once('/') else { continue };
        if root().join(name.trim_end_matches(".rs")).is_dir() {
            wrong.push(format!("{name} stands beside a folder of that name"));
        }
        if name == "src/lib.rs" {
            continue;
        }
        if !["mod.rs", "lib.rs"].contains(&file) {
            *n_files.entry(folder.to_owned()).or_default() += 1;
            continue;
        }
        let mut statements = without_comments(&text);
        statements.retain(|c| c != '\n');
        for statement in statements.split(';').map(str::trim).filter(|statement| !statement.is_empty()) {
            let mut words = statement;
            while let Some(rest) = words.strip_prefix("#[").and_then(|rest| rest.split_once(']')) {
                words = rest.1.trim_start();
            }
            let is_map = [
                "mod ",
                "pub mod ",
                "pub(crate) mod ",
                "pub(super) mod ",
                "pub use ",
                "pub(crate) use ",
                "pub(super) use ",
            ];
            if !words.is_empty() && !is_map.iter().any(|word| words.starts_with(word)) {
                wrong.push(format!("{name} holds code: {words}"));
            }
        }
    }
    let crowded = n_files.into_iter().filter(|(_, n)| *n > 16);
    wrong.extend(crowded.map(|(folder, n)| format!("{folder} holds {n} files")));
    none(&wrong);
}

/// Names of the structs, enums and traits that `text` defines outside of its tests.
fn types(text: &str) -> Vec<String> {
    let tokens = tokens(without_tests(&without_comments(text)));
    let defines = |pair: &[String]| ["struct", "enum", "trait"].contains(&pair[0].as_str());
    tokens.windows(2).filter(|pair| defines(pair)).map(|pair| pair[1].clone()).collect()
}

#[test]
fn a_type_name_is_defined_once() {
    let mut files: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (name, text) in rust_texts().into_iter().filter(|(name, _)| name.starts_with("src/") && !name.contains("/cli/"))
    {
        types(&text).into_iter().for_each(|defined| _ = files.entry(defined).or_default().insert(name.clone()));
    }
    files.retain(|name, files| files.len() > 1 && !COMMON_NAMES.contains(&name.as_str()));
    assert!(files.is_empty(), "{files:#?}");
}

#[test]
fn stages_and_their_files_are_spelt_in_one_file() {
    let names = ["extract", "pose2d", "segment", "lift"];
    let files = ["audio.wav", "timeline.npz", "media.json", "keypoints.npz", "measures.npz", "joints.npz"];
    let files = [&files[..], &["bones.json", "camera.json", "bone_change.npz", "hashes.json"]].concat();
    // The settings of a stage are a section of the fingerprint: a key of JSON.
    none(&spelt_outside("base/stage/artifacts.rs", |string, is_key| {
        files.contains(&string) || names.contains(&string) && !is_key
    }));
}

#[test]
fn reasons_of_refusals_are_worded_in_one_file() {
    // Reasons that are a single word of everyday use ("arms", "face") are also names of body parts and of measures.
    let common = ["quiet", "still", "face", "arms", "bones", "hands", "cut", "open", "jump", "no sound"];
    let reasons = Refusal::JUDGED.map(Refusal::reason);
    let is_reason = |string: &str| reasons.contains(&string) && !common.contains(&string);
    none(&spelt_outside("base/stage/refusal.rs", |string, _| is_reason(string)));
}

/// Strings in code of the library and the program, outside `home` and outside tests, for which `is_wrong` holds; its
/// second argument says whether a colon follows, as behind a key of JSON.
fn spelt_outside(home: &str, is_wrong: impl Fn(&str, bool) -> bool) -> Vec<String> {
    let mut wrong = Vec::new();
    let is_test = |path: &Path| path.components().any(|part| part.as_os_str() == "tests");
    for path in rust_files(&root().join("src")).into_iter().filter(|path| !path.ends_with(home) && !is_test(path)) {
        let (code, strings) = scan(&fs::read_to_string(&path).unwrap());
        let n_code = without_tests(&code).len();
        for (string, end) in strings.into_iter().filter(|(_, end)| *end <= n_code) {
            if is_wrong(&string, code[end..].trim_start().starts_with(':')) {
                wrong.push(format!("{}: \"{string}\"", below_root(&path)));
            }
        }
    }
    wrong
}

#[test]
fn unsafe_code_stays_in_six_places() {
    let homes = [
        "src/nn/cpu/",
        "src/media/ffmpeg/",
        "src/media/file_memory.rs",
        "src/media/sandbox/stop_signals.rs",
        "src/process.rs",
        "tests/it/robustness/sandbox.rs",
    ];
    let texts = rust_texts().into_iter().filter(|(name, _)| !homes.iter().any(|home| name.starts_with(home)));
    let names = texts.filter(|(_, text)| tokens(&without_comments(text)).iter().any(|token| token == "unsafe"));
    none(&names.map(|(name, _)| name).collect::<Vec<_>>());
}

/// Which files ffmpeg may follow is decided where it opens one.
#[test]
fn media_are_opened_in_one_file() {
    let opens =
        |text: &str| ["format::input", "avformat_open_input"].iter().any(|call| without_comments(text).contains(call));
    let sources = rust_texts().into_iter().filter(|(name, text)| name.starts_with("src/") && opens(text));
    let names: Vec<String> = sources.map(|(name, _)| name).collect();
    assert_eq!(names, ["src/media/ffmpeg/source.rs"]);
}
