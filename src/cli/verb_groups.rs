//! The list of verbs in `orator --help`, by group.

use clap::{Command, Subcommand};
use orator_base::stage::artifacts::StageName;
use std::fmt::Write as _;

/// Groups of verbs, in the order of a project.
const GROUPS: [(&str, &[&str]); 5] = [
    (
        "Dataset",
        &[
            "init",
            "run",
            "status",
            "report",
            "view",
            StageName::Lift.as_str(),
            "import",
            "transcribe",
            "align",
            "dataset",
            "forget",
            "plan",
            "work",
            "submit",
        ],
    ),
    ("Training", &["train"]),
    ("Animation", &["generate", "live", "animate"]),
    ("Evaluation", &["evaluate", "study"]),
    ("Setup", &["doctor", "models", "words", "guide", "completions", "man"]),
];

/// Help of a program in which [`list`] replaces the list of subcommands.
pub(super) const TEMPLATE: &str = "{about-with-newline}\n{usage-heading} {usage}\n\n{before-help}Options:\n{options}\n";

/// The verbs of `V` with their descriptions, a paragraph for each group.
pub(super) fn list<V: Subcommand>() -> String {
    let command = V::augment_subcommands(Command::new("orator"));
    let mut text = String::new();
    for (group, verbs) in GROUPS {
        let _ = writeln!(text, "{group}:");
        for verb in verbs.iter().filter_map(|verb| command.find_subcommand(verb)) {
            let about = verb.get_about().map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {:12} {about}", verb.get_name());
        }
        text.push('\n');
    }
    text + "`orator VERB --help` describes a verb; `orator guide` lists the pages of the guide."
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::program::Verb;
    use std::collections::BTreeSet;

    #[test]
    fn every_verb_is_in_one_group_with_a_description_of_one_line() {
        let command = Verb::augment_subcommands(Command::new("orator"));
        let shown = command.get_subcommands().filter(|verb| !verb.is_hide_set());
        let shown: BTreeSet<&str> = shown.map(Command::get_name).collect();
        let grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, verbs)| verbs.iter().copied()).collect();
        assert_eq!(grouped.len(), shown.len());
        assert_eq!(grouped.into_iter().collect::<BTreeSet<_>>(), shown);
        assert!(list::<Verb>().lines().all(|line| line.len() <= 90), "{}", list::<Verb>());
    }
}
