//! `orator init`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result};
use orator_base::stage::workdir;
use orator_dataset::config::DEFAULT_FILE;
use serde_json::json;
use std::path::PathBuf;

/// Create a project folder with a commented pipeline.toml.
#[derive(clap::Args)]
pub struct Args {
    /// Project folder; created if it does not exist.
    dir: PathBuf,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let file = args.dir.join("pipeline.toml");
    anyhow::ensure!(!file.exists(), "{} already exists; nothing was changed", file.display());
    for folder in ["videos/host", "models"] {
        let folder = args.dir.join(folder);
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    }
    workdir::write_file(&file, DEFAULT_FILE.as_bytes())?;
    let videos = args.dir.join("videos/host");
    let text = format!("wrote {}\nput the videos of one speaker into {}", file.display(), videos.display());
    let next = format!("orator models fetch -c {}", file.display());
    ui.summary(&text, Some(&next), json!({ "file": file, "next": next }));
    Ok(Outcome::Done)
}
