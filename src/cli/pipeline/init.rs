//! `orator init`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail, ensure};
use orator_base::stage::workdir;
use orator_dataset::config::DEFAULT_FILE;
use orator_dataset::config::patterns::{VIDEO_EXTENSIONS, has_extension};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Create a project folder with a commented pipeline.toml.
#[derive(clap::Args)]
pub struct Args {
    /// Project folder; created if it does not exist.
    dir: PathBuf,
    /// Videos of one speaker, which stay where they are; without any, the project uses those in videos/host.
    videos: Vec<PathBuf>,
}

/// Absolute path of a video as text.
fn video(path: &Path) -> Result<String> {
    ensure!(path.exists(), "{} does not exist: expected a video", path.display());
    ensure!(
        path.is_file() && has_extension(path, &VIDEO_EXTENSIONS),
        "{} is not a video: expected a file that ends in {}",
        path.display(),
        VIDEO_EXTENSIONS.join(", ")
    );
    let text = std::path::absolute(path)?.into_os_string().into_string();
    text.ok().with_context(|| format!("{} is not valid UTF-8: rename it", path.display()))
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let file = args.dir.join("pipeline.toml");
    ensure!(!file.exists(), "{} already exists; nothing was changed", file.display());
    let videos: Vec<String> = args.videos.iter().map(|path| video(path)).collect::<Result<_>>()?;
    let mut files = BTreeMap::new();
    for path in &args.videos {
        if let Some(other) = files.insert(path.canonicalize().unwrap_or_else(|_| path.clone()), path) {
            bail!("{} and {} are the same file: give each video once", other.display(), path.display());
        }
    }
    for folder in ["videos/host", "models"] {
        let folder = args.dir.join(folder);
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    }
    let folder = args.dir.join("videos/host");
    let (config, text, next) = if videos.is_empty() {
        let text = format!("wrote {}\nput the videos of one speaker into {}", file.display(), folder.display());
        (DEFAULT_FILE.to_owned(), text, format!("orator models fetch -c {}", file.display()))
    } else {
        let config = DEFAULT_FILE.replacen("[\"videos/host\"]", &json!(videos).to_string(), 1);
        (config, format!("wrote {}", file.display()), format!("orator run -c {} --train", file.display()))
    };
    workdir::write_file(&file, config.as_bytes())?;
    ui.summary(&text, Some(&next), json!({ "file": file, "next": next }));
    Ok(Outcome::Done)
}
