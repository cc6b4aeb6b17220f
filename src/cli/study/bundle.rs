//! `orator study bundle`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_study::bundle::files;
use orator_study::folder::StudyFolder;
use serde_json::json;
use std::path::PathBuf;

/// Write a study as static files, for a web host that only collects what is sent.
///
/// In `public` is what to upload: the page, the films, and each session under a name that tells nothing, without the
/// key and without right answers. README.md says what the collecting address must do and what a host of plain files
/// cannot enforce: balance, order, once only, an answer after the films, withdrawal.
#[derive(clap::Args)]
pub struct Args {
    /// The study's folder, of `orator study build`.
    #[arg(value_name = "DIR")]
    study: PathBuf,
    /// Address to which the page sends what participants do, by POST.
    #[arg(long, value_name = "URL")]
    post: String,
    /// The new folder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let bundled = files::write(&StudyFolder::new(&args.study), &args.post, &args.out)?;
    let n_sessions = bundled.sessions.len();
    let public = args.out.join("public");
    let text = format!(
        "{n_sessions} sessions in {}, to be uploaded\n{} says what such a study cannot enforce",
        public.display(),
        args.out.join("README.md").display()
    );
    ui.summary(&text, None, json!({ "sessions": n_sessions, "public": public, "study": bundled.study }));
    Ok(Outcome::Done)
}
