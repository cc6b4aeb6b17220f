//! `orator evaluate compare`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Result, bail};
use orator_gesture::evaluate::table::compare;
use orator_gesture::evaluate::table::result::StoredResult;
use serde_json::json;
use std::path::PathBuf;

/// Put two results side by side, and refuse what is not comparable.
///
/// Each value of a result holds the hash of its definition and parameters. Values of one hash are shown beside each other;
/// of a metric whose hashes differ it is said in which parameters, and the exit code is 1.
#[derive(clap::Args)]
pub struct Args {
    /// What `orator evaluate --json` wrote.
    #[arg(value_name = "A.json")]
    a: PathBuf,
    /// Another one.
    #[arg(value_name = "B.json")]
    b: PathBuf,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let compared = compare::compare(&StoredResult::read(&args.a)?, &StoredResult::read(&args.b)?);
    let is_refused = !compared.refused.is_empty();
    if compared.beside.is_empty() && !is_refused {
        bail!("{} and {} have no metric in common", args.a.display(), args.b.display());
    }
    let text = format!("A: {}\nB: {}\n\n{}", args.a.display(), args.b.display(), compare::text(&compared));
    ui.summary(&text, None, json!({ "compared": compared }));
    Ok(if is_refused { Outcome::Wrong } else { Outcome::Done })
}
