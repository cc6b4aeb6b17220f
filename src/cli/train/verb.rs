//! `orator train`, with one file per network.

use super::{gan, seq2seq, stopped};
use crate::cli::Outcome;
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
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    stopped::stop_on_signal(ui);
    let ended = match args.network {
        Network::Gan(args) => gan::run(args, ui),
        Network::Seq2seq(args) => seq2seq::run(args, ui),
    };
    ended.or_else(|error| stopped::report_stopped(error, ui))
}
