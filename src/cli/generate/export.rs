//! `orator generate --export`: the trained network as ONNX.

use crate::cli::Outcome;
use crate::cli::outputs::is_same_file;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use orator_base::stage::progress::Progress as _;
use orator_gesture::export;
use orator_gesture::generate::model::{GenerationChoice, checkpoint_file, model_lock};
use serde_json::json;
use std::path::Path;

pub(super) fn run(given: &Path, choice: &GenerationChoice, out: &Path, carry_state: bool, ui: &Ui) -> Result<Outcome> {
    enter_sandbox([out], [given]);
    let checkpoint = checkpoint_file(given)?;
    if checkpoint != *given {
        ui.say(&format!("checkpoint {}", checkpoint.display()));
    }
    ensure!(!is_same_file(out, &checkpoint), "output {} is the checkpoint; choose another path", out.display());
    let _lock = model_lock(&checkpoint)?;
    let files = export::export(&checkpoint, choice, out, carry_state)?;
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    let facts = json!({ "checkpoint": checkpoint, "outputs": names });
    ui.summary(&format!("wrote {}", names.join(", ")), Some("orator guide onnx"), facts);
    Ok(Outcome::Done)
}
