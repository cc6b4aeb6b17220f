//! `orator study`: its verbs.

use super::{analyse, build, export, plan, serve};
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;

/// A user study of gestures: build its films, serve it, analyse the answers.
///
/// A study file (STUDY.toml) says whose motion is compared, by which questions, by how many participants, and what is
/// tested; `orator guide study` describes it.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: StudyVerb,
}

#[derive(clap::Subcommand)]
enum StudyVerb {
    Plan(plan::Args),
    Build(build::Args),
    Serve(serve::Args),
    Export(export::Args),
    Analyse(analyse::Args),
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.verb {
        StudyVerb::Plan(args) => plan::run(&args, ui),
        StudyVerb::Build(args) => build::run(&args, ui),
        StudyVerb::Serve(args) => serve::run(&args, ui),
        StudyVerb::Export(args) => export::run(&args, ui),
        StudyVerb::Analyse(args) => analyse::run(&args, ui),
    }
}
