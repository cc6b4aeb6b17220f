//! All error messages of the product in one list, `tests/it/snapshots/error_messages.snap`, which is reviewed as a whole
//! when a message changes.

use crate::fixtures::sources::{rust_files, scan, without_tests};
use std::fs;
use std::path::PathBuf;

/// Calls whose text arguments are errors.
const CALLS: [&str; 8] =
    ["bail!(", "ensure!(", "anyhow!(", ".context(", ".with_context(", "Err(format!(", "Error::new(", ".problem("];

/// Crates whose errors no user of `orator` meets.
const OTHER: [&str; 2] = ["src/lab/", "tests/support/"];

/// End of the call whose arguments begin at `start`.
fn end_of_call(code: &str, start: usize) -> usize {
    let mut depth = 1;
    let inside = code[start..].char_indices().find(|(_, c)| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        depth == 0
    });
    inside.map_or(code.len(), |(at, _)| start + at)
}

/// Messages in the calls of a file: literals of at least two words, in the order of the file.
fn messages(text: &str) -> Vec<String> {
    let (code, strings) = scan(without_tests(text));
    let starts = CALLS.iter().flat_map(|call| code.match_indices(call).map(move |(at, _)| at + call.len()));
    let mut calls: Vec<(usize, usize)> = starts.map(|start| (start, end_of_call(&code, start))).collect();
    calls.sort_unstable();
    let is_inside = |end: usize| calls.iter().any(|(from, to)| (*from..*to).contains(&(end - 1)));
    let found = strings.into_iter().filter(|(message, end)| message.trim().contains(' ') && is_inside(*end));
    let joined = |message: String| message.split("\\\n").map(str::trim_start).collect::<String>();
    found.map(|(message, _)| joined(message).replace("\\\"", "\"").replace("\\n", "\n    ")).collect()
}

fn list() -> String {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let mut list = String::new();
    for file in rust_files(&root.join("src")) {
        let name = file.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
        let found = messages(&fs::read_to_string(&file).unwrap());
        if !found.is_empty() && !OTHER.iter().any(|other| name.starts_with(other)) {
            list += &format!("{name}\n  {}\n", found.join("\n  "));
        }
    }
    list
}

#[test]
fn the_list_of_error_messages_is_reviewed() {
    insta::with_settings!({
        snapshot_path => "../snapshots", prepend_module_to_snapshot => false, omit_expression => true
    }, { insta::assert_snapshot!("error_messages", list()) });
}

#[test]
fn messages_are_found_in_the_calls_that_report_errors() {
    let text =
        "fn a() { ensure!(x == f(\"no message\"), \"invalid {x} in \\\n    {}\", name.join(\", \")); print(\"a b\") }";
    assert_eq!(messages(text), ["no message", "invalid {x} in {}"]);
}
