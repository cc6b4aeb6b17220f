//! `orator-lab`: the verbs, and the entry point.

use super::{demo, docs, evaluate, train};
use anyhow::Result;
use clap::{Parser, Subcommand};
use orator::cli::ui::Ui;
use orator::cli::{Outcome, run_program};
use std::process::ExitCode;

/// Synthetic speakers with known motion, training and evaluation of the lifters that `orator` ships, and the guide as a
/// site.
#[derive(Parser)]
#[command(
    name = "orator-lab",
    version,
    help_expected = true,
    subcommand_required = true,
    arg_required_else_help = true
)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
    /// Print one JSON object on standard output instead of text.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Verb {
    Demo(demo::Args),
    Train(train::Args),
    Evaluate(evaluate::Args),
    Docs(docs::Args),
}

/// Parses the command line, runs the verb, reports an error, and returns the exit code.
pub fn main() -> ExitCode {
    run_program(|cli: &Cli| cli.json, run)
}

fn run(cli: Cli, ui: &Ui) -> Result<Outcome> {
    match cli.verb {
        Verb::Demo(args) => demo::run(args, ui),
        Verb::Train(args) => train::run(args, ui),
        Verb::Evaluate(args) => evaluate::run(args, ui),
        Verb::Docs(args) => docs::run(&args, ui),
    }
}

#[cfg(test)]
mod tests {
    /// Every argument has its help, and no two clash.
    #[test]
    fn the_command_line_is_valid() {
        <super::Cli as clap::CommandFactory>::command().debug_assert();
    }
}
