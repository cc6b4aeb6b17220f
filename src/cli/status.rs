//! `orator status`.

use super::{Outcome, ui::Ui};

/// Show every stage of every video: fresh, stale, failed.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
