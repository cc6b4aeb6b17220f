//! `orator train`: one file a network.

mod gan;
mod lifter;

use super::{Outcome, ui::Ui};

/// Train the lifters or a speaker's generator.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    network: Network,
}

#[derive(clap::Subcommand)]
enum Network {
    Gan(gan::Args),
    Lifter(lifter::Args),
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    match args.network {
        Network::Gan(args) => gan::run(args, ui),
        Network::Lifter(args) => lifter::run(args, ui),
    }
}
