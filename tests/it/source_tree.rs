//! Rules of the source tree that Cargo cannot check: which crate owns a foreign library, where unsafe code is, and how
//! files and types are divided. The layers themselves are the dependencies in the manifests of the crates.

use crate::fixtures::sources::{rust_files, scan, tokens, without_comments, without_tests};
use orator_base::stage::rejection::Rejection;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules of a crate that must not import each other.
const SIBLINGS: [(&str, &[&str]); 2] = [
    ("src/pipeline", &["extract", "pose2d", "segment", "lift", "transcribe", "dataset"]),
    ("src/media", &["ffmpeg", "opencv", "aligner"]),
];

/// Folders whose code is not part of the product.
const NOT_PRODUCT: [&str; 2] = ["src/lab/", "tests/"];

/// Names that several types may have.
const COMMON_NAMES: [&str; 3] = ["Args", "Config", "Cli"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Rust files of `src` and `tests`: path relative to the repository, and text.
fn rust_texts() -> Vec<(String, String)> {
    let files = ["src", "tests"].into_iter().flat_map(|folder| rust_files(&root().join(folder)));
    files.map(|file| (relative(&file), fs::read_to_string(&file).unwrap())).collect()
}

fn relative(file: &Path) -> String {
    file.strip_prefix(root()).unwrap().to_str().unwrap().to_owned()
}

fn assert_none(violations: &[String]) {
    assert!(violations.is_empty(), "{} places:\n{}", violations.len(), violations.join("\n"));
}

/// Manifests of the root package and of all members: path relative to the repository, and names of dependencies.
fn manifests() -> Vec<(String, BTreeSet<String>)> {
    let members = fs::read_dir(root().join("src")).unwrap().map(|entry| entry.unwrap().path().join("Cargo.toml"));
    let files = ["Cargo.toml", "tests/support/Cargo.toml"]
        .map(|file| root().join(file))
        .into_iter()
        .chain(members)
        .filter(|file| file.is_file());
    let read = |file: PathBuf| {
        let manifest: toml::Table = fs::read_to_string(&file).unwrap().parse().unwrap();
        let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table);
        (relative(&file), dependencies.into_iter().flat_map(toml::Table::keys).cloned().collect())
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
        ("axum", "src/web/Cargo.toml"),
        ("hyper", "src/web/Cargo.toml"),
        ("tower-http", "src/web/Cargo.toml"),
        ("rusqlite", "src/study/Cargo.toml"),
    ];
    let manifests = manifests();
    assert!(manifests.len() >= 11, "{manifests:?}");
    let mut violations = Vec::new();
    for (manifest, dependencies) in &manifests {
        let foreign = owners.iter().filter(|(library, owner)| dependencies.contains(*library) && owner != manifest);
        violations
            .extend(foreign.map(|(library, owner)| format!("{manifest} names {library}, which belongs to {owner}")));
    }
    assert_none(&violations);
}

#[test]
fn no_product_crate_depends_on_the_lab_or_test_support() {
    let not_product = ["orator-lab", "orator-test-support"];
    let product =
        manifests().into_iter().filter(|(name, _)| !NOT_PRODUCT.iter().any(|folder| name.starts_with(folder)));
    let violations = product.filter(|(_, dependencies)| not_product.iter().any(|name| dependencies.contains(*name)));
    assert_none(&violations.map(|(name, _)| name).collect::<Vec<_>>());
}

#[test]
fn only_the_command_line_prints() {
    let mut violations = Vec::new();
    for (name, text) in rust_texts().into_iter().filter(|(name, _)| name.starts_with("src/") && !name.contains("/cli/"))
    {
        let tokens = tokens(without_tests(&without_comments(&text)));
        if tokens.windows(2).any(|pair| ["print", "println"].contains(&pair[0].as_str()) && pair[1] == "!") {
            violations.push(name);
        }
    }
    assert_none(&violations);
}

#[test]
fn siblings_do_not_import_each_other() {
    let mut violations = Vec::new();
    for (name, text) in rust_texts() {
        let code = without_comments(&text);
        let code = without_tests(&code);
        for (folder, siblings) in SIBLINGS {
            let sibling = name.strip_prefix(folder).and_then(|rest| rest[1..].split('/').next());
            let Some(here) = sibling.filter(|here| siblings.contains(here)) else { continue };
            let others = siblings.iter().filter(|other| **other != here);
            let imported = others.filter(|other| code.contains(&format!("crate::{other}::")));
            violations.extend(imported.map(|other| format!("{name} imports {other}")));
        }
        if name.starts_with("src/report/html/") && code.replace("crate::html::", "").contains("crate::") {
            violations.push(format!("{name} imports from outside of html"));
        }
    }
    assert_none(&violations);
}

#[test]
fn folders_have_at_most_16_files_and_mod_files_no_code() {
    let mut violations = Vec::new();
    let mut n_files: BTreeMap<String, usize> = BTreeMap::new();
    for (name, text) in rust_texts() {
        let Some((folder, file)) = name.rsplit_once('/') else { continue };
        if root().join(name.trim_end_matches(".rs")).is_dir() {
            violations.push(format!("{name} stands beside a folder of that name"));
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
            let declarations = [
                "mod ",
                "pub mod ",
                "pub(crate) mod ",
                "pub(super) mod ",
                "pub use ",
                "pub(crate) use ",
                "pub(super) use ",
            ];
            if !words.is_empty() && !declarations.iter().any(|word| words.starts_with(word)) {
                violations.push(format!("{name} holds code: {words}"));
            }
        }
    }
    let crowded = n_files.into_iter().filter(|(_, n)| *n > 16);
    violations.extend(crowded.map(|(folder, n)| format!("{folder} holds {n} files")));
    assert_none(&violations);
}

/// Names of the structs, enums and traits that `text` defines outside of its tests.
fn types(text: &str) -> Vec<String> {
    let tokens = tokens(without_tests(&without_comments(text)));
    let defines = |pair: &[String]| ["struct", "enum", "trait"].contains(&pair[0].as_str()) && pair[1] != "$";
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
fn names_of_stages_and_their_files_are_defined_in_one_file() {
    let names = ["extract", "pose2d", "segment", "lift"];
    let files = ["audio.wav", "timeline.npz", "media.json", "keypoints.npz", "measures.npz", "joints.npz"];
    let files = [&files[..], &["bones.json", "camera.json", "bone_change.npz", "hashes.json"]].concat();
    // The settings of a stage are a section of the fingerprint, a JSON key.
    assert_none(&strings_outside("base/stage/artifacts.rs", |string, is_key| {
        files.contains(&string) || names.contains(&string) && !is_key
    }));
}

#[test]
fn rejection_reasons_are_defined_in_one_file() {
    // Single words of everyday use ("arms", "face") are also names of body parts and of measures.
    let common = ["quiet", "still", "face", "arms", "bones", "hands", "cut", "open", "jump", "no sound"];
    let reasons = Rejection::JUDGED.map(Rejection::reason);
    let is_reason = |string: &str| reasons.contains(&string) && !common.contains(&string);
    assert_none(&strings_outside("base/stage/rejection.rs", |string, _| is_reason(string)));
}

/// Strings in code of the library and the program, outside `home` and outside tests, for which `is_misplaced` holds;
/// its second argument is whether a colon follows, as after a JSON key.
fn strings_outside(home: &str, is_misplaced: impl Fn(&str, bool) -> bool) -> Vec<String> {
    let mut violations = Vec::new();
    let is_test = |path: &Path| path.components().any(|part| part.as_os_str() == "tests");
    for path in rust_files(&root().join("src")).into_iter().filter(|path| !path.ends_with(home) && !is_test(path)) {
        let (code, strings) = scan(&fs::read_to_string(&path).unwrap());
        let n_code = without_tests(&code).len();
        for (string, end) in strings.into_iter().filter(|(_, end)| *end <= n_code) {
            if is_misplaced(&string, code[end..].trim_start().starts_with(':')) {
                violations.push(format!("{}: \"{string}\"", relative(&path)));
            }
        }
    }
    violations
}

#[test]
fn unsafe_code_is_confined_to_nine_modules() {
    let modules = [
        "src/nn/gpu/",
        "src/nn/cpu/",
        "src/nn/cuda/",
        "src/media/ffmpeg/",
        "src/media/file_memory.rs",
        "src/media/sandbox/stop_signals.rs",
        "src/process.rs",
        "tests/it/fixtures/gpu_shim.rs",
        "tests/it/robustness/sandbox.rs",
    ];
    let texts = rust_texts().into_iter().filter(|(name, _)| !modules.iter().any(|home| name.starts_with(home)));
    let names = texts.filter(|(_, text)| tokens(&without_comments(text)).iter().any(|token| token == "unsafe"));
    assert_none(&names.map(|(name, _)| name).collect::<Vec<_>>());
}

/// The files that ffmpeg may follow are restricted where it opens one.
#[test]
fn media_are_opened_in_one_file() {
    let opens =
        |text: &str| ["format::input", "avformat_open_input"].iter().any(|call| without_comments(text).contains(call));
    let sources = rust_texts().into_iter().filter(|(name, text)| name.starts_with("src/") && opens(text));
    let names: Vec<String> = sources.map(|(name, _)| name).collect();
    assert_eq!(names, ["src/media/ffmpeg/source.rs"]);
}
