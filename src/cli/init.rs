//! `orator init`.

use super::{Outcome, ui::Ui};

/// Write a commented pipeline.toml and the folders.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
