//! Report of a training that stopped on request.

use crate::StoppedTraining;
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_cluster::job::shell;
use serde_json::json;
use std::path::Path;

/// From now on, the first Ctrl-C or SIGTERM stops a training after the current step, with a checkpoint.
pub fn stop_on_signal(ui: &Ui) {
    const STOPPING: &str = "stopping after the current step and saving a checkpoint; a second signal exits at once";
    ui.enable_stop_requests(STOPPING, "the newest checkpoint is saved; run the same command again to resume");
}

/// Prints the report of a training that stopped on request; returns any other error.
pub fn report_stopped(error: anyhow::Error, ui: &Ui) -> Result<Outcome> {
    let stopped: StoppedTraining = error.downcast()?;
    let StoppedTraining { step, steps, newest, best } = &stopped;
    let mut text = format!("stopped after step {step} of {steps}");
    match newest {
        Some(newest) => text += &format!("\nnewest checkpoint  {}", newest.display()),
        None => text += "; there is no checkpoint yet",
    }
    if let Some((step, best)) = best {
        text += &format!("\nbest (step {step})  {}", best.display());
    }
    let next = same_command();
    let facts = json!({
        "stopped": true,
        "step": step,
        "steps": steps,
        "newest": newest,
        "best": best.as_ref().map(|(_, best)| best),
        "best_step": best.as_ref().map(|(step, _)| step),
        "next": next,
    });
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Stopped)
}

/// The command as it was typed, quoted for a shell.
pub fn same_command() -> String {
    let mut words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let program = words.next().and_then(|path| Some(Path::new(&path).file_name()?.to_string_lossy().into_owned()));
    shell(&std::iter::once(program.unwrap_or_else(|| "orator".to_owned())).chain(words).collect::<Vec<_>>())
}
