//! `orator models`.

use super::{Outcome, ui::Ui};

/// List, fetch, add and check the ONNX models.
#[derive(clap::Args)]
pub struct Args {}

pub fn run(_args: Args, _ui: &Ui) -> anyhow::Result<Outcome> {
    anyhow::bail!("not built yet")
}
