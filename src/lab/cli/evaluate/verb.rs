//! `orator-lab evaluate`.

use super::{lifter, people};
use anyhow::Result;
use orator::cli::Outcome;
use orator::cli::sandbox::enter_sandbox;
use orator::cli::ui::Ui;

/// Measure the lifters on known motion, and the pipeline on rendered persons.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    subject: Subject,
}

#[derive(clap::Subcommand)]
enum Subject {
    Lifter(lifter::Args),
    People(people::Args),
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.subject {
        Subject::Lifter(args) => lifter::run(args, ui),
        Subject::People(args) => {
            enter_sandbox(args.report.as_deref(), []);
            people::run(&args, ui)
        }
    }
}
