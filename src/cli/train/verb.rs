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
    stopped::stop_on_signal(ui);
    let ended = match args.network {
        Network::Gan(args) => gan::run(args, ui),
        Network::Seq2seq(args) => seq2seq::run(args, ui),
        Network::Basis(args) => args.fail("train basis"),
        Network::Embedding(args) => args.fail("train embedding"),
        Network::Lifter(args) => args.fail("train lifter"),
        Network::Noise(args) => args.fail("train noise"),
    };
    ended.or_else(|error| stopped::report_stopped(error, ui))
}
