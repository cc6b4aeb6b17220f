//! `orator train`.

use super::{Outcome, ui::Ui};

/// Train the lifters or the speaker's generator.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
