//! The command line of `orator`: its verbs, and the program that parses it, runs a verb, reports errors and returns the
//! exit code (see the parent module for the codes).

use super::cluster::{plan, submit, work};
use super::dataset::{align, forget, import, transcribe, verify as dataset};
use super::motion::lift;
use super::pipeline::{init, report, run, status};
use super::setup::{completions, doctor, models, words};
use super::signals;
use super::ui::Ui;
use super::{animate, evaluate, generate, live, study, train, ui, verb_groups, view};
use anyhow::Result;
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use orator_base::stage::workdir;
use orator_pipeline::process::{VERB, serve};
use std::process::ExitCode;

/// Result of a verb that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All work is done.
    Done,
    /// Some units failed (each was reported); the others are done.
    SomeFailed,
    /// Stopped on request (Ctrl-C, SIGTERM) at a point from which the same command continues.
    Stopped,
    /// A check (of the set-up or a dataset) failed; the problems were printed.
    CheckFailed,
}

/// Build a 3D speech-gesture dataset from videos of a speaker, and train a model that gestures like the speaker.
#[derive(Parser)]
#[command(name = "orator", version, help_expected = true, subcommand_required = true, arg_required_else_help = true)]
#[command(before_help = verb_groups::list::<Verb>(), help_template = verb_groups::TEMPLATE)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
    /// Print one JSON object on standard output instead of text.
    #[arg(long, global = true)]
    json: bool,
}

/// The verbs of `orator`.
#[derive(Subcommand)]
pub(super) enum Verb {
    Init(init::Args),
    Run(run::Args),
    Status(status::Args),
    Plan(plan::Args),
    Work(work::Args),
    Submit(submit::Args),
    Models(models::Args),
    Words(words::Args),
    Doctor(doctor::Args),
    Lift(lift::Args),
    Report(report::Args),
    Import(import::Args),
    Transcribe(transcribe::Args),
    Align(align::Args),
    Forget(forget::Args),
    Dataset(dataset::Args),
    Train(train::Args),
    Evaluate(evaluate::Args),
    Generate(generate::Args),
    Live(live::Args),
    Animate(animate::Args),
    Study(study::Args),
    View(view::Args),
    Guide(completions::GuideArgs),
    Completions(completions::Args),
    Man(completions::ManArgs),
}

/// Parses the command line, runs the verb, reports an error, and returns the exit code.
pub fn main() -> ExitCode {
    // This comes first because the subprocess of a unit must restrict itself while it has a single thread.
    if std::env::args_os().nth(1).is_some_and(|verb| verb == VERB) {
        signals::ignore_signals();
        let ended = serve().inspect_err(|error| ui::note(&format!("error: {error:#}")));
        return if ended.is_ok() { ExitCode::SUCCESS } else { ExitCode::from(1) };
    }
    run_program(|cli: &Cli| cli.json, run)
}

fn run(cli: Cli, ui: &Ui) -> Result<Outcome> {
    match cli.verb {
        Verb::Init(args) => init::run(args, ui),
        Verb::Run(args) => run::run(args, ui),
        Verb::Status(args) => status::run(args, ui),
        Verb::Plan(args) => plan::run(args, ui),
        Verb::Work(args) => work::run(args, ui),
        Verb::Submit(args) => submit::run(args, ui),
        Verb::Models(args) => models::run(args, ui),
        Verb::Words(args) => words::run(args, ui),
        Verb::Doctor(args) => doctor::run(args, ui),
        Verb::Lift(args) => lift::run(args, ui),
        Verb::Report(args) => report::run(args, ui),
        Verb::Dataset(args) => dataset::run(args, ui),
        Verb::Import(args) => import::run(args, ui),
        Verb::Transcribe(args) => transcribe::run(args, ui),
        Verb::Align(args) => align::run(args, ui),
        Verb::Forget(args) => forget::run(args, ui),
        Verb::Train(args) => train::run(args, ui),
        Verb::Evaluate(args) => evaluate::run(args, ui),
        Verb::Generate(args) => generate::run(args, ui),
        Verb::Live(args) => live::run(args, ui),
        Verb::Animate(args) => animate::run(args, ui),
        Verb::Study(args) => study::run(args, ui),
        Verb::View(args) => view::run(args, ui),
        Verb::Guide(args) => completions::run_guide(&args, ui),
        Verb::Completions(args) => completions::run(&args, Cli::command(), ui),
        Verb::Man(args) => completions::run_man(&args, Cli::command(), ui),
    }
}

/// Parses the command line into `C`, runs it, reports an error, and returns the exit code. `json` reads the `--json`
/// flag.
pub fn run_program<C: CommandFactory + FromArgMatches>(
    json: impl FnOnce(&C) -> bool,
    run: impl FnOnce(C, &Ui) -> Result<Outcome>,
) -> ExitCode {
    let command = C::command();
    let name = command.get_name().to_owned();
    let parsed = command.try_get_matches().and_then(|matches| {
        workdir::announce(verb_path(&name, &matches));
        C::from_arg_matches(&matches)
    });
    let cli = match parsed {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print();
            return if error.use_stderr() { ExitCode::from(1) } else { ExitCode::SUCCESS };
        }
    };
    let ui = Ui::new(json(&cli));
    match run(cli, &ui) {
        Ok(_) if ui.has_output_error() => ExitCode::from(1),
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::SomeFailed) => ExitCode::from(2),
        Ok(Outcome::Stopped) => ExitCode::from(ui.stop_code()),
        Ok(Outcome::CheckFailed) => ExitCode::from(1),
        Err(error) => {
            ui.error(&error);
            ExitCode::from(1)
        }
    }
}

/// The program and its verb, such as `orator train gan`.
fn verb_path(program: &str, matches: &ArgMatches) -> String {
    let (mut path, mut next) = (program.to_owned(), matches.subcommand());
    while let Some((verb, matches)) = next {
        path += &format!(" {verb}");
        next = matches.subcommand();
    }
    path
}

#[cfg(test)]
mod tests {
    /// Every argument has help, and no two conflict.
    #[test]
    fn the_command_line_is_valid() {
        <super::Cli as clap::CommandFactory>::command().debug_assert();
    }
}
