//! The tutorial of the guide: its commands run in order in one shell, and what they print is compared with the page.

use orator_test_support::project::program;
use std::process::{Command, Stdio};

/// Stands for the rest of a line, or alone for any number of lines.
const ANY: &str = "...";
/// Begins the line that follows the output of a command.
const END: &str = "=== end of command ";

/// Commands of the `console` blocks of a page, each with the lines it prints.
fn commands(page: &str) -> Vec<(String, Vec<&str>)> {
    let mut commands: Vec<(String, Vec<&str>)> = Vec::new();
    let mut in_console = false;
    for line in page.lines() {
        if line.starts_with("```") {
            in_console = line == "```console";
        } else if let Some(command) = line.strip_prefix("$ ").filter(|_| in_console) {
            commands.push((command.to_owned(), Vec::new()));
        } else if in_console {
            commands.last_mut().expect("output follows a command").1.push(line);
        }
    }
    commands
}

fn line_matches(pattern: &str, line: &str) -> bool {
    let parts: Vec<&str> = pattern.split(ANY).collect();
    let [first, middle @ .., last] = &parts[..] else { return pattern == line };
    let Some(mut rest) = line.strip_prefix(first) else { return false };
    for part in middle {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

fn matches(expected: &[&str], printed: &[&str]) -> bool {
    match expected.split_first() {
        None => printed.is_empty(),
        Some((&ANY, others)) => (0..=printed.len()).any(|k| matches(others, &printed[k..])),
        Some((pattern, others)) => printed
            .split_first()
            .is_some_and(|(line, below)| line_matches(pattern, line.trim_end()) && matches(others, below)),
    }
}

#[test]
fn dots_match_rests_of_lines_and_lines() {
    assert!(line_matches("wrote ... files", "wrote 3 files") && line_matches("a...", "a") && line_matches("a", "a"));
    assert!(
        !line_matches("wrote ... files", "wrote 3 file") && !line_matches("a", "ab") && !line_matches("a...b", "b")
    );
    assert!(matches(&["a", ANY, "c"], &["a", "b", "b", "c"]) && matches(&["a", ANY], &["a"]));
    assert!(!matches(&["a"], &["a", "b"]) && !matches(&[ANY, "c"], &["a", "b"]) && !matches(&["a", "b"], &["a"]));
    let page = "text\n```console\n$ a\nb\n$ c\n```\n```sh\n$ d\n```\n";
    assert_eq!(commands(page), [("a".to_owned(), vec!["b"]), ("c".to_owned(), vec![])]);
}

#[test]
fn the_commands_of_the_tutorial_print_what_it_shows() {
    let page = orator::guide::TOPICS.into_iter().find(|topic| topic.name == "tutorial").unwrap();
    let commands = commands(page.text);
    assert!(commands.len() > 10, "{commands:?}");
    let dir = tempfile::tempdir().unwrap();
    let programs = program("orator-lab").parent().unwrap().to_owned();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(programs).chain(std::env::split_paths(&path))).unwrap();
    let script: String = commands.iter().map(|(command, _)| format!("{command}\necho '{END}'$?\n")).collect();
    let mut shell = Command::new("bash");
    shell.args(["-c", &script]).current_dir(dir.path()).env("PATH", path).stdin(Stdio::null());
    let output = shell.output().unwrap();
    let (printed, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let mut lines = printed.lines();
    for (command, expected) in commands {
        let (mut shown, mut code) = (Vec::new(), "");
        for line in lines.by_ref() {
            if let Some(status) = line.strip_prefix(END) {
                code = status;
                break;
            }
            shown.push(line);
        }
        assert_eq!(code, "0", "{command}: {}\n{errors}", shown.join("\n"));
        assert!(matches(&expected, &shown), "{command} prints\n{}\nnot\n{}", shown.join("\n"), expected.join("\n"));
    }
}
