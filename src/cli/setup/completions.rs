//! `orator guide`, `orator completions` and `orator man`: documentation for users, shells and `man`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use crate::guide::{TOPICS, Topic};
use anyhow::{Context, Result};
use clap::Command;
use clap::builder::PossibleValuesParser;
use clap_complete::Shell;
use clap_mangen::Man;
use serde_json::json;
use std::path::PathBuf;

/// Print a shell completion script.
///
/// bash: `orator completions bash > ~/.local/share/bash-completion/completions/orator`. fish: `orator completions fish >
/// ~/.config/fish/completions/orator.fish`. zsh: `orator completions zsh > FOLDER/_orator`, with a FOLDER of `fpath`.
#[derive(clap::Args)]
pub struct Args {
    /// Shell for which the script is printed.
    shell: Shell,
}

/// Print or write manual pages.
///
/// `orator man | man -l -` shows the page of the program; `orator man ~/.local/share/man/man1` installs the pages of
/// all verbs, for `man orator-run`.
#[derive(clap::Args)]
pub struct ManArgs {
    /// Folder for `orator.1`, `orator-run.1` and all other pages; without it `orator.1` is printed.
    #[arg(value_name = "DIR")]
    dir: Option<PathBuf>,
}

/// Print a page of the guide.
///
/// Pages are Markdown, for example `orator guide dataset | less`.
#[derive(clap::Args)]
pub struct GuideArgs {
    /// Page to print; without it the list of pages is printed.
    #[arg(value_parser = PossibleValuesParser::new(TOPICS.map(|topic| topic.name)))]
    topic: Option<String>,
}

/// Prints the completion script of a shell; `command` is the program's own command line.
pub fn run(args: &Args, mut command: Command, ui: &Ui) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "orator", &mut script);
    let script = String::from_utf8(script)?;
    ui.summary(&script, None, json!({ "shell": args.shell.to_string(), "script": script }));
    Ok(Outcome::Done)
}

/// Prints or writes the manual pages; `command` is the program's own command line.
pub fn run_man(args: &ManArgs, command: Command, ui: &Ui) -> Result<Outcome> {
    if let Some(dir) = &args.dir {
        let written = std::fs::create_dir_all(dir).and_then(|()| clap_mangen::generate_to(command, dir));
        written.with_context(|| format!("cannot write manual pages into {}", dir.display()))?;
        ui.summary(&format!("manual pages in {}", dir.display()), None, json!({ "dir": dir }));
    } else {
        let mut page = Vec::new();
        Man::new(command).render(&mut page)?;
        let page = String::from_utf8(page)?;
        ui.summary(&page, None, json!({ "page": page }));
    }
    Ok(Outcome::Done)
}

/// Prints a page of the guide, or the list of pages.
pub fn run_guide(args: &GuideArgs, ui: &Ui) -> Result<Outcome> {
    let facts = |topic: &Topic| json!({ "topic": topic.name, "summary": topic.summary });
    match TOPICS.iter().find(|topic| Some(topic.name) == args.topic.as_deref()) {
        Some(topic) => {
            let mut page = facts(topic);
            page["text"] = topic.text.into();
            ui.summary(topic.text, None, page);
        }
        None => {
            let lines = TOPICS.map(|topic| format!("{:14} {}", topic.name, topic.summary)).join("\n");
            let list: Vec<_> = TOPICS.iter().map(facts).collect();
            ui.summary(&lines, Some("orator guide TOPIC"), json!({ "topics": list }));
        }
    }
    Ok(Outcome::Done)
}
