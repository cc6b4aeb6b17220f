//! `orator train lifter`.

use crate::cli::{Outcome, ui::Ui};

/// Train the networks that lift 2D keypoints to 3D joints.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
