//! `orator train`: one file a network.

use super::{basis, embedding, gan, lifter, noise, pose, seq2seq, stopped};
use crate::cli::Outcome;
use crate::cli::signals;
use crate::cli::ui::Ui;

/// Train the lifters, a model of bodies, a speaker's generator, or the spaces that `evaluate` compares motion in.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    network: Network,
}

#[derive(clap::Subcommand)]
enum Network {
    Basis(basis::Args),
    Embedding(embedding::Args),
    Gan(gan::Args),
    Lifter(lifter::Args),
    Noise(noise::Args),
    Pose(pose::Args),
    Seq2seq(seq2seq::Args),
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    const STOPPING: &str = "stopping after this step, with a checkpoint; the next signal ends at once";
    const KEPT: &str = "the newest checkpoint is kept, and the same command goes on from it";
    match args.network {
        Network::Basis(_) | Network::Noise(_) => signals::tell_when_stopped("nothing is kept of what was begun"),
        _ => ui.listens_for_stop(STOPPING, KEPT),
    }
    let ended = match args.network {
        Network::Basis(args) => basis::run(args, ui),
        Network::Embedding(args) => embedding::run(args, ui),
        Network::Gan(args) => gan::run(args, ui),
        Network::Lifter(args) => lifter::run(args, ui),
        Network::Noise(args) => noise::run(&args, ui),
        Network::Pose(args) => pose::run(&args, ui),
        Network::Seq2seq(args) => seq2seq::run(args, ui),
    };
    ended.or_else(|error| stopped::told(error, ui))
}
