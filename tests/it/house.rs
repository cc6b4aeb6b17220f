//! Rules of the source tree: who may import whom, where types and foreign libraries live, what a file and a comment
//! look like. `FLOORS` is the table of `src/lib.rs`.

use crate::fixtures::imports::{SourceFile, Sources, rust_files, scan, tokens, without_comments, without_tests};
use orator::stage::refusal::Refusal;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Floor, room, and the rooms it may import.
const FLOORS: [(u8, &str, &str); 22] = [
    (1, "types", ""),
    (1, "math", ""),
    (1, "stage", ""),
    (2, "config", "types stage"),
    (2, "external", "types stage"),
    (2, "audio", "types"),
    (2, "motion", "types math"),
    (3, "formats", "types math stage motion"),
    (3, "nn", "types motion"),
    (3, "render", "types math"),
    (4, "mocap", "types math motion formats"),
    (4, "metrics", "types math nn"),
    (4, "generate", "types audio motion formats nn"),
    (4, "animate", "types math stage motion formats external render"),
    (5, "dataset", "types math stage config audio motion formats external mocap"),
    (6, "pipeline", "types math stage config external audio motion formats nn generate animate dataset"),
    (6, "train", "types math stage config external audio motion formats nn mocap dataset metrics generate"),
    (6, "demo", "types math stage audio motion formats external mocap render animate dataset metrics generate"),
    (7, "cluster", "types stage config external formats pipeline"),
    (
        7,
        "evaluate",
        "types math stage config external audio motion formats nn mocap metrics generate animate dataset pipeline train",
    ),
    (8, "report", "types stage config external formats metrics animate dataset pipeline train evaluate"),
    (
        9,
        "study",
        "types math stage config external audio motion formats mocap metrics generate animate dataset evaluate report",
    ),
];

/// Folders that import nothing of each other: pairwise siblings under a room.
const APART: [(&str, &[&str]); 2] = [
    ("pipeline", &["extract", "pose2d", "segment", "lift", "shard", "dataset"]),
    ("external", &["ffmpeg", "opencv", "onnx", "aligner"]),
];

/// Names that several types may carry.
const COMMON_NAMES: [&str; 2] = ["Args", "Config"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn library() -> Sources {
    Sources::read(&root().join("src/lib.rs"))
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

/// Pairs of importing and imported file.
fn imports(sources: &Sources) -> Vec<(&SourceFile, &SourceFile)> {
    let pairs = |from: usize| sources.imports(from).into_iter().map(move |to| (from, to));
    let all = (0..sources.files.len()).flat_map(pairs);
    all.map(|(from, to)| (&sources.files[from], &sources.files[to])).collect()
}

#[test]
fn the_map_in_lib_rs_is_the_table() {
    let text = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let rows = text.lines().filter_map(|line| line.strip_prefix("//! | "));
    let cells = rows.map(|row| row.trim_end_matches('|').split(" | ").map(str::trim).collect::<Vec<_>>());
    let shown: Vec<Vec<&str>> = cells.filter(|row| row[0].parse::<u8>().is_ok()).collect();
    assert_eq!(shown.len(), FLOORS.len(), "rows of the map");
    for (row, (floor, room, may_import)) in shown.into_iter().zip(FLOORS) {
        assert_eq!(row.len(), 4, "{room}");
        assert_eq!(row[0], floor.to_string(), "floor of {room}");
        assert_eq!(row[1], format!("`{room}`"), "room");
        assert!(!row[2].is_empty(), "{room} has no account");
        let expected = if may_import.is_empty() { "nothing".to_owned() } else { format!("`{may_import}`") };
        assert_eq!(row[3], expected, "imports of {room}");
    }
}

#[test]
fn every_folder_is_a_room() {
    let folders = fs::read_dir(root().join("src")).unwrap().map(|entry| entry.unwrap().path());
    let folders: BTreeSet<String> = folders
        .filter(|path| path.is_dir())
        .map(|path| path.file_name().unwrap().to_str().unwrap().to_owned())
        .collect();
    // `cli` belongs to the program; `guide` holds texts alone.
    let rooms = FLOORS.iter().map(|(_, room, _)| *room).chain(["cli"]);
    let known: BTreeSet<String> = rooms.map(str::to_owned).collect();
    let missing: Vec<_> = known.difference(&folders).collect();
    assert!(missing.is_empty(), "no folder: {missing:?}");
    let unknown: Vec<_> = folders.difference(&known).filter(|name| *name != "guide").collect();
    assert!(unknown.is_empty(), "not in the table: {unknown:?}");
}

#[test]
fn imports_run_downwards_only() {
    let sources = library();
    let mut wrong = Vec::new();
    let all = imports(&sources);
    for (from, to) in &all {
        let (room, other) = (from.room(), to.room());
        let Some((floor, _, allowed)) = FLOORS.iter().find(|(_, name, _)| *name == room) else { continue };
        if room == other {
            continue;
        }
        let below = FLOORS.iter().any(|(lower, name, _)| *name == other && lower < floor);
        if !below || !allowed.split(' ').any(|name| name == other) {
            wrong.push(format!("{} imports {}", from.name, to.name));
        }
    }
    none(&wrong);
}

#[test]
fn siblings_stay_apart() {
    let sources = library();
    let mut wrong = Vec::new();
    for (from, to) in imports(&sources) {
        for (room, siblings) in APART {
            let sibling = |file: &SourceFile| {
                let rest = file.name.strip_prefix(room)?.strip_prefix('/')?;
                siblings.iter().find(|name| rest.starts_with(&format!("{name}/"))).copied()
            };
            if let (Some(here), Some(there)) = (sibling(from), sibling(to))
                && here != there
            {
                wrong.push(format!("{} imports {}", from.name, to.name));
            }
        }
        if from.name.starts_with("report/html/") && !to.name.starts_with("report/html/") {
            wrong.push(format!("{} imports {}", from.name, to.name));
        }
    }
    none(&wrong);
}

/// Groups of files that import each other, by Tarjan's strongly connected components.
fn circles(sources: &Sources) -> Vec<Vec<String>> {
    struct Search<'a> {
        next: &'a dyn Fn(usize) -> Vec<usize>,
        index: BTreeMap<usize, usize>,
        low: BTreeMap<usize, usize>,
        stack: Vec<usize>,
        found: Vec<Vec<usize>>,
    }
    fn visit(search: &mut Search, file: usize) {
        let number = search.index.len();
        search.index.insert(file, number);
        search.low.insert(file, number);
        search.stack.push(file);
        for next in (search.next)(file) {
            if !search.index.contains_key(&next) {
                visit(search, next);
                search.low.insert(file, search.low[&file].min(search.low[&next]));
            } else if search.stack.contains(&next) {
                search.low.insert(file, search.low[&file].min(search.index[&next]));
            }
        }
        if search.low[&file] == search.index[&file] {
            let begin = search.stack.iter().position(|other| *other == file).unwrap();
            let group = search.stack.split_off(begin);
            if group.len() > 1 {
                search.found.push(group);
            }
        }
    }
    // Maps re-export their folder's files and have no code of their own.
    let is_code = |file: &usize| !sources.files[*file].is_map();
    let next = |file: usize| sources.imports(file).into_iter().filter(is_code).collect();
    let mut search =
        Search { next: &next, index: BTreeMap::new(), low: BTreeMap::new(), stack: Vec::new(), found: Vec::new() };
    for file in (0..sources.files.len()).filter(is_code) {
        if !search.index.contains_key(&file) {
            visit(&mut search, file);
        }
    }
    search.found.iter().map(|group| group.iter().map(|file| sources.files[*file].name.clone()).collect()).collect()
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    for root_file in ["src/lib.rs", "tests/it/main.rs"] {
        let circles = circles(&Sources::read(&root().join(root_file)));
        assert!(circles.is_empty(), "{root_file}: {circles:#?}");
    }
}

#[test]
fn tests_import_helpers_from_fixtures_alone() {
    let sources = Sources::read(&root().join("tests/it/main.rs"));
    let code = imports(&sources).into_iter().filter(|(from, to)| !from.is_map() && !to.is_map());
    let wrong = code.filter(|(_, to)| to.room() != "fixtures");
    none(&wrong.map(|(from, to)| format!("{} imports {}", from.name, to.name)).collect::<Vec<_>>());
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
        if file != "mod.rs" {
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
            let is_map = ["mod ", "pub mod ", "pub(crate) mod ", "pub use ", "pub(crate) use "];
            if !words.is_empty() && !is_map.iter().any(|word| words.starts_with(word)) {
                wrong.push(format!("{name} holds code: {words}"));
            }
        }
    }
    let crowded = n_files.into_iter().filter(|(_, n)| *n > 16);
    wrong.extend(crowded.map(|(folder, n)| format!("{folder} holds {n} files")));
    none(&wrong);
}

#[test]
fn a_type_name_stands_once() {
    let sources = library();
    let mut files: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for file in &sources.files {
        file.types().into_iter().for_each(|name| files.entry(name).or_default().push(&file.name));
    }
    files.retain(|name, files| files.len() > 1 && !COMMON_NAMES.contains(name));
    assert!(files.is_empty(), "{files:#?}");
}

#[test]
fn stages_and_their_files_are_spelt_in_one_file() {
    let names = ["extract", "pose2d", "segment", "lift"];
    let files = ["audio.wav", "timeline.npz", "media.json", "keypoints.npz", "measures.npz", "joints.npz"];
    let files = [&files[..], &["bones.json", "camera.json", "bone_change.npz", "hashes.json"]].concat();
    // The settings of a stage are a section of the fingerprint: a key of JSON.
    none(&spelt_outside("stage/artifacts.rs", |string, is_key| {
        files.contains(&string) || names.contains(&string) && !is_key
    }));
}

#[test]
fn reasons_of_refusals_are_worded_in_one_file() {
    // Reasons that are a single word of everyday use ("arms", "face") are also names of body parts and of measures.
    let common = ["quiet", "still", "face", "arms", "bones", "hands", "cut", "open", "jump", "no sound"];
    let reasons = Refusal::JUDGED.map(Refusal::reason);
    let is_reason = |string: &str| reasons.contains(&string) && !common.contains(&string);
    none(&spelt_outside("stage/refusal.rs", |string, _| is_reason(string)));
}

/// Strings in code of the library and the program, outside `home` and outside tests, for which `is_wrong` holds; its
/// second argument says whether a colon follows, as behind a key of JSON.
fn spelt_outside(home: &str, is_wrong: impl Fn(&str, bool) -> bool) -> Vec<String> {
    let mut wrong = Vec::new();
    for path in rust_files(&root().join("src")).into_iter().filter(|path| !path.ends_with(home)) {
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
fn foreign_libraries_have_one_door_each() {
    let doors = [
        ("ffmpeg_next", "external/ffmpeg/"),
        ("opencv", "external/opencv/"),
        ("ort", "external/onnx/"),
        ("clap", "cli/"),
        ("indicatif", "cli/"),
    ];
    let mut wrong = Vec::new();
    for file in &library().files {
        let libraries = file.libraries();
        for (library, door) in doors {
            if libraries.contains(library) && !file.name.starts_with(door) {
                wrong.push(format!("{} names {library}, whose door is {door}", file.name));
            }
        }
        let prints =
            file.tokens.windows(2).any(|pair| ["print", "println"].contains(&pair[0].as_str()) && pair[1] == "!");
        if prints && file.room() != "cli" {
            wrong.push(format!("{} prints", file.name));
        }
    }
    none(&wrong);
}

#[test]
fn unsafe_code_stays_in_four_places() {
    let homes = ["src/nn/cpu/", "src/external/ffmpeg/", "src/external/file_memory.rs", "src/process.rs"];
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
    assert_eq!(names, ["src/external/ffmpeg/source.rs"]);
}
