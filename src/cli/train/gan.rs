//! `orator train gan`.

use crate::cli::{Outcome, ui::Ui};

/// Train a speaker's speech-to-gesture generator.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
