//! `orator completions` and `orator man`: what shells and `man` know of the program.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result};
use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;
use serde_json::json;
use std::path::PathBuf;

/// Print the script that completes verbs and options in a shell.
///
/// bash: `orator completions bash > ~/.local/share/bash-completion/completions/orator`. fish: `orator completions fish >
/// ~/.config/fish/completions/orator.fish`. zsh: `orator completions zsh > FOLDER/_orator`, with a FOLDER of `fpath`.
#[derive(clap::Args)]
pub struct Args {
    /// Shell that reads the script.
    shell: Shell,
}

/// Print the manual page, or write the pages of all verbs into a folder.
///
/// `orator man | man -l -` shows it; `orator man ~/.local/share/man/man1` installs all, for `man orator-run`.
#[derive(clap::Args)]
pub struct ManArgs {
    /// Folder for `orator.1`, `orator-run.1` and all others; none: `orator.1` is printed.
    #[arg(value_name = "DIR")]
    dir: Option<PathBuf>,
}

/// Prints the script of a shell; `command` is the program's own command line.
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
