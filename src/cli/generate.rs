//! `orator generate`.

use super::{Outcome, ui::Ui};

/// Turn speech into motion with a trained speaker.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
