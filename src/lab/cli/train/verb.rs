//! `orator-lab train`: one file a network.

use super::{basis, embedding, lifter, noise};
use anyhow::Result;
use orator::cli::Outcome;
use orator::cli::signals;
use orator::cli::train::stopped;
use orator::cli::ui::Ui;

/// Train lifters, fit keypoint noise, or build the spaces of `orator evaluate`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    network: Network,
}

#[derive(clap::Subcommand)]
enum Network {
    Basis(basis::Args),
    Embedding(embedding::Args),
    Lifter(lifter::Args),
    Noise(noise::Args),
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    const STOPPING: &str =
        "stopping after this step and writing a checkpoint; send the signal again to stop immediately";
    const RETAINED: &str = "the newest checkpoint is retained; run the same command to continue from it";
    match args.network {
        Network::Basis(_) | Network::Noise(_) => signals::exit_on_signal("unfinished work is discarded"),
        _ => ui.enable_stop_requests(STOPPING, RETAINED),
    }
    let ended = match args.network {
        Network::Basis(args) => basis::run(args, ui),
        Network::Embedding(args) => embedding::run(args, ui),
        Network::Lifter(args) => lifter::run(args, ui),
        Network::Noise(args) => noise::run(&args, ui),
    };
    ended.or_else(|error| stopped::report_stopped(error, ui))
}
