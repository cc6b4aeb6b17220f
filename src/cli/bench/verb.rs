//! `orator bench`: how fast a part of the road is, measured so that a noisy machine cannot flatter it: the variants take
//! turns, round after round, and the median round counts. One file a part.

use super::{animate, dataset, evaluate, generate, lift, lifter, pose2d, scale, spaces, train};
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;

/// Measure the speed of a part of the road.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    part: Part,
}

#[derive(clap::Subcommand)]
enum Part {
    Animate(animate::Args),
    Pose2d(pose2d::Args),
    Dataset(dataset::Args),
    Evaluate(evaluate::Args),
    Generate(generate::Args),
    Lift(lift::Args),
    Lifter(lifter::Args),
    Run(super::run::Args),
    Scale(scale::Args),
    Spaces(spaces::Args),
    Train(train::Args),
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.part {
        Part::Animate(args) => animate::run(&args, ui),
        Part::Pose2d(args) => pose2d::run(&args, ui),
        Part::Dataset(args) => dataset::run(&args, ui),
        Part::Evaluate(args) => evaluate::run(&args, ui),
        Part::Generate(args) => generate::run(&args, ui),
        Part::Lift(args) => lift::run(&args, ui),
        Part::Lifter(args) => lifter::run(&args, ui),
        Part::Run(args) => super::run::run(&args, ui),
        Part::Scale(args) => scale::run(&args, ui),
        Part::Spaces(args) => spaces::run(&args, ui),
        Part::Train(args) => train::run(&args, ui),
    }
}

pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}
