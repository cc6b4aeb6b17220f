//! The house's own rules: who may import whom, how long a file may be, which words stay in which room.

use std::fs;
use std::path::{Path, PathBuf};

/// A room and the rooms it may import.
const MAY_IMPORT: [(&str, &str); 24] = [
    ("types", ""),
    ("stage", "types"),
    ("config", "types stage"),
    ("media", "types stage"),
    ("vision", "types stage"),
    ("onnx", "types stage config"),
    ("audio", "types"),
    ("motion", "types"),
    ("metrics", "types motion nn"),
    ("nn", "types motion"),
    ("dataset", "types stage config motion media audio"),
    ("extract", "types stage config media vision"),
    ("pose2d", "types stage config media vision onnx motion"),
    ("segment", "types stage config motion media"),
    ("lift", "types stage config motion nn"),
    ("train", "types stage config motion nn audio dataset metrics"),
    ("evaluate", "types stage config motion media nn train lift metrics audio dataset generate import"),
    ("generate", "types stage config motion nn audio dataset train metrics"),
    ("animate", "types stage config motion media vision"),
    ("page", ""),
    ("report", "types stage config motion media vision segment animate page train metrics evaluate"),
    ("import", "types stage config motion media audio dataset"),
    ("forget", "types stage config dataset"),
    ("demo", "types stage config motion media vision audio dataset animate train generate metrics"),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// Rooms named in the file's `use crate::...` lines and `crate::...` paths.
fn imports(text: &str) -> Vec<String> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    let mut rooms = Vec::new();
    for line in code {
        for (at, _) in line.match_indices("crate::") {
            let rest = &line[at + "crate::".len()..];
            let group = rest.strip_prefix('{').and_then(|rest| rest.split('}').next()).unwrap_or(rest);
            let names = if rest.starts_with('{') { group.split(',').collect() } else { vec![rest] };
            for name in names {
                let room: String = name.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if !room.is_empty() {
                    rooms.push(room);
                }
            }
        }
    }
    rooms
}

#[test]
fn rooms_import_only_what_the_plan_allows() {
    let mut wrong = Vec::new();
    for (room, allowed) in MAY_IMPORT {
        let folder = root().join("src").join(room);
        for file in rust_files(&folder) {
            for import in imports(&fs::read_to_string(&file).unwrap()) {
                let known = MAY_IMPORT.iter().any(|(name, _)| *name == import);
                if known && import != room && !allowed.split(' ').any(|name| name == import) {
                    wrong.push(format!("{} imports {import}", file.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_room_is_in_the_plan_and_on_the_map() {
    let map = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    for entry in fs::read_dir(root().join("src")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "cli" {
            assert!(MAY_IMPORT.iter().any(|(room, _)| *room == name), "{name} is not in the plan");
            assert!(map.contains(&format!("`{name}`")), "{name} is not on the map in src/lib.rs");
        }
    }
}

#[test]
fn outside_tools_have_one_door_each() {
    let doors = [
        ("ffmpeg_next", "media"),
        ("opencv::", "vision"),
        ("ort::", "onnx"),
        ("clap::", "cli"),
        ("indicatif", "cli"),
        ("println!", "cli"),
    ];
    let src = root().join("src");
    for file in rust_files(&src) {
        let text = fs::read_to_string(&file).unwrap();
        let room = file.strip_prefix(&src).unwrap().iter().next().unwrap().to_string_lossy().into_owned();
        for (word, door) in doors {
            let starts_a_word = |at: usize| !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            let found = text.match_indices(word).any(|(at, _)| starts_a_word(at));
            let code = found && text.lines().any(|line| line.contains(word) && !line.trim_start().starts_with("//"));
            if code && room != door {
                panic!("{} names {word}, whose door is {door}", file.display());
            }
        }
    }
}

#[test]
fn no_file_is_longer_than_400_lines() {
    let files = ["src", "tests"].into_iter().flat_map(|folder| rust_files(&root().join(folder)));
    let long: Vec<String> = files
        .map(|file| (fs::read_to_string(&file).unwrap().lines().count(), file))
        .filter(|(lines, _)| *lines > 400)
        .map(|(lines, file)| format!("{lines} {}", file.display()))
        .collect();
    assert!(long.is_empty(), "{}", long.join("\n"));
}

#[test]
fn every_file_says_what_lives_in_it() {
    for file in rust_files(&root().join("src")) {
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.starts_with("//!"), "{} has no //! paragraph", file.display());
    }
}
