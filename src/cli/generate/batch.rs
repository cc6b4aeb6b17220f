//! Motion for many audio files in one call.

use crate::cli::Outcome;
use crate::cli::config_args::DeviceArgs;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::signals;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::text::{counted, first_three};
use orator_base::types::device::DeviceChoice;
use orator_gesture::batch::{BatchReport, BatchState, SpeechBatch};
use orator_gesture::generate::seq2seq::metadata::cpu_only;
use serde_json::json;

/// Maximum number of files in the final table, not counting failures.
const MAX_LISTED: usize = 30;

pub fn run(batch: &SpeechBatch, device: DeviceArgs, ui: &Ui) -> Result<Outcome> {
    let checkpoints = batch.sounds.iter().filter_map(|sound| sound.checkpoint.as_deref());
    let checkpoints = checkpoints.chain(batch.checkpoint.as_deref());
    let device = device.open(DeviceChoice::Cpu, || cpu_only(checkpoints.clone()), ui)?;
    if device.is_cpu() {
        enter_sandbox([batch.folder.as_path()], checkpoints);
    }
    signals::exit_on_signal("completed audio files are saved; run the same command again to continue");
    let report = batch.run(&device, ui)?;
    ui.summary(&text(&report), None, json!(report));
    Ok(if report.failed > 0 { Outcome::SomeFailed } else { Outcome::Done })
}

fn text(report: &BatchReport) -> String {
    let width = report.sounds.iter().map(|sound| sound.out.chars().count()).max().unwrap_or(0).clamp(4, 40);
    let (mut text, mut n_listed) = (String::new(), 0);
    for sound in &report.sounds {
        let facts = |key: &str| sound.facts.get(key).cloned().unwrap_or_default();
        let word = match (sound.ended, &sound.error) {
            (BatchState::Created, _) => "generated",
            (BatchState::UpToDate, _) => "up to date",
            (BatchState::Failed, error) => {
                text += &format!("{:width$}  failed  {}\n", sound.out, error.as_deref().unwrap_or_default());
                continue;
            }
        };
        n_listed += 1;
        if n_listed <= MAX_LISTED {
            let note = facts("note").as_str().map_or(String::new(), |note| format!("  note: {note}"));
            text += &format!(
                "{:width$}  {word:10}  {:8.1} s {:7} frames  {}{note}\n",
                sound.out,
                facts("secs").as_f64().unwrap_or(0.0),
                facts("n_frames"),
                facts("speaker").as_str().unwrap_or_default(),
            );
        }
    }
    if n_listed > MAX_LISTED {
        text += &format!("and {} more\n", n_listed - MAX_LISTED);
    }
    let BatchReport { created, up_to_date, failed, out_folder, sounds, passed_over } = report;
    if !passed_over.is_empty() {
        let (n, names) = (counted(passed_over.len(), "file"), first_three(passed_over));
        text += &format!("passed over {n} without audio: {names}\n");
    }
    let sounds = counted(sounds.len(), "audio file");
    text + &format!(
        "{sounds}: {created} generated, {up_to_date} up to date, {failed} failed; in {}",
        out_folder.display()
    )
}
