//! `orator doctor`.

use super::{Outcome, ui::Ui};

/// Say what is installed, what is missing, and the command that fixes it.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
