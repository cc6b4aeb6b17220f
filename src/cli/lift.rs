//! `orator lift`.

use super::{Outcome, ui::Ui};

/// Lift 2D keypoints to 3D joints, outside a run.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
