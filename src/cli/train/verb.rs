//! `orator train`, with one file per network.

use super::{gan, seq2seq, stopped};
use crate::cli::Outcome;
use crate::cli::moved::MovedVerb;
use crate::cli::ui::Ui;

/// Train a gesture generator on a dataset.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    network: Network,
}

#[derive(clap::Subcommand)]
enum Network {
    Gan(gan::Args),
    Seq2seq(seq2seq::Args),
    #[command(hide = true)]
    Basis(MovedVerb),
    #[command(hide = true)]
    Embedding(MovedVerb),
    #[command(hide = true)]
    Lifter(MovedVerb),
    #[command(hide = true)]
    Noise(MovedVerb),
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    const STOPPING: &str = "stopping after this step, with a checkpoint; the next signal ends at once";
    const KEPT: &str = "the newest checkpoint is kept, and the same command goes on from it";
    ui.enable_stop_requests(STOPPING, KEPT);
    let ended = match args.network {
        Network::Gan(args) => gan::run(args, ui),
        Network::Seq2seq(args) => seq2seq::run(args, ui),
        Network::Basis(args) => args.refuse("train basis"),
        Network::Embedding(args) => args.refuse("train embedding"),
        Network::Lifter(args) => args.refuse("train lifter"),
        Network::Noise(args) => args.refuse("train noise"),
    };
    ended.or_else(|error| stopped::report_stopped(error, ui))
}
