//! Command line of the benchmark: selects the part to measure and prints the result.

use super::bodies::{animate, render};
use super::report::{Bars, Report};
use super::training::{lifter, seq2seq, train};
use super::{claims, cluster, dataset, evaluate, generate, lift, pose2d, run, scale, spaces, study};
use anyhow::{Context, Result};
use clap::{CommandFactory, Parser, Subcommand};
use orator_base::stage::progress::Progress;
use std::ffi::OsString;
use std::process::ExitCode;

/// Measure the speed of a part of the pipeline.
#[derive(Parser)]
#[command(name = "cargo bench --", help_expected = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    part: Option<Part>,
    /// Print one JSON object on standard output instead of text.
    #[arg(long, global = true)]
    json: bool,
    /// Passed by `cargo bench`; ignored.
    #[arg(long, global = true, hide = true)]
    bench: bool,
}

#[derive(Subcommand)]
enum Part {
    Animate(animate::Args),
    Claims(claims::Args),
    Cluster(cluster::Args),
    Pose2d(pose2d::Args),
    Dataset(dataset::Args),
    Evaluate(evaluate::Args),
    Generate(generate::Args),
    Lift(lift::Args),
    Lifter(lifter::Args),
    Render(render::Args),
    Run(run::Args),
    Scale(scale::Args),
    Seq2seq(seq2seq::Args),
    Spaces(spaces::Args),
    Study(study::Args),
    Train(train::Args),
}

impl Part {
    fn measure(&self, progress: &dyn Progress) -> Result<Report> {
        match self {
            Part::Animate(args) => animate::run(args, progress),
            Part::Claims(args) => claims::run(args, progress),
            Part::Cluster(args) => cluster::run(args, progress),
            Part::Pose2d(args) => pose2d::run(args, progress),
            Part::Dataset(args) => dataset::run(args, progress),
            Part::Evaluate(args) => evaluate::run(args, progress),
            Part::Generate(args) => generate::run(args, progress),
            Part::Lift(args) => lift::run(args, progress),
            Part::Lifter(args) => lifter::run(args, progress),
            Part::Render(args) => render::run(args, progress),
            Part::Run(args) => run::run(args, progress),
            Part::Scale(args) => scale::run(args, progress),
            Part::Seq2seq(args) => seq2seq::run(args, progress),
            Part::Spaces(args) => spaces::run(args, progress),
            Part::Study(args) => study::run(args, progress),
            Part::Train(args) => train::run(args, progress),
        }
    }
}

/// Measures the part selected by the command line `args`, for callers other than `main`.
///
/// # Errors
/// Fails on an unknown argument, a missing part, or a failed measurement.
pub(crate) fn measure(args: impl IntoIterator<Item = impl Into<OsString>>, progress: &dyn Progress) -> Result<Report> {
    let program = OsString::from("bench");
    let cli = Cli::try_parse_from(std::iter::once(program).chain(args.into_iter().map(Into::into)))?;
    cli.part.context("no part to measure")?.measure(progress)
}

/// Parses the command line, measures, prints the result. Exit code 1 after an error.
#[allow(clippy::print_stdout)] // prints the result
pub(crate) fn main() -> ExitCode {
    let cli = Cli::parse();
    let Some(part) = &cli.part else {
        println!("{}", Cli::command().render_help());
        return ExitCode::SUCCESS;
    };
    match part.measure(&Bars::default()) {
        Ok(report) if cli.json => println!("{}", report.facts),
        Ok(report) => println!("{}", report.text.trim_end()),
        Err(error) => {
            eprintln!("error: {error:#}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
