//! `orator study export`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_study::export::{TableForm, export};
use orator_study::folder::StudyFolder;
use serde_json::json;
use std::path::PathBuf;

/// Write the responses of a study as tables, also while it is being served.
///
/// `votes` has a row for each answered trial: participant, task, design, phase, trial (from 1), clip, speaker, conditions
/// (from left to right), response and expected (left or right; real or generated; -2 to 2; scores; a number), stalled_secs,
/// unfocused_secs, response_secs, plays, completed. `participants` has a row for each participant: participant, place,
/// language, status (active, completed, replaced), answers, failed_checks, begun_ms (since 1970), code, and what the
/// recruiting site gave along. Several values in a cell are joined by |.
#[derive(clap::Args)]
pub struct Args {
    /// The study's folder.
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// Form of the tables: columns with a header, or JSON Lines.
    #[arg(long, value_parser = ["csv", "jsonl"], default_value = "csv")]
    format: String,
    /// Folder to write them into; without: DIR/export.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let form = if args.format == "csv" { TableForm::Csv } else { TableForm::Jsonl };
    let out = args.out.clone().unwrap_or_else(|| args.dir.join("export"));
    let exported = export(&StudyFolder::new(&args.dir), form, &out)?;
    let text = format!(
        "{} votes of {} participants: {}, {}",
        exported.n_votes,
        exported.n_participants,
        exported.votes.display(),
        exported.participants.display()
    );
    let next = format!("orator study analyse {}", args.dir.display());
    ui.summary(&text, Some(&next), json!(exported));
    Ok(Outcome::Done)
}
