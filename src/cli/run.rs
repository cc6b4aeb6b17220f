//! `orator run`.

use super::{Outcome, ui::Ui};

/// Run the stages extract, pose2d, segment, lift, shard for every video of every speaker.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
