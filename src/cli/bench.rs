//! `orator bench`.

use super::{Outcome, ui::Ui};

/// Measure the speed of a part of the road.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
