//! `orator view`.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::sandbox::this_program;
use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use orator_dataset::decisions::MAX_CHARS;
use orator_view::file::ViewedFile;
use orator_view::project::Project;
use orator_view::view_server::{self, ViewRequest};
use serde_json::json;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// Look at videos, decisions, trainings and results in the browser.
///
/// A page on this machine shows every video with its keypoints and the avatar in sync, which seconds were accepted or
/// rejected and why, running trainings, and motion that a checkpoint generates for a dropped or recorded sound. With
/// --edit, ranges can be accepted or rejected, hands swapped, the speaker chosen and words corrected; these decisions
/// are stored in decisions.toml beside the configuration, and the next `orator run` applies them.
///
/// With FILE, the page shows one avatar or motion instead: .glb, .vrm, .bvh, .npz (joints or SMPL-X), .npy or .txt,
/// with the audio file of the same name.
///
/// The address contains a secret token: whoever has it can see the project. Only this machine can reach it; from
/// another one, forward the port with `ssh -L`. Ctrl-C ends the server.
#[derive(clap::Args)]
pub struct Args {
    /// Avatar or motion to show instead of the project.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    config: ConfigArgs,
    /// Allow decisions.
    #[arg(long, conflicts_with = "file")]
    edit: bool,
    /// Author of the decisions; defaults to the name of the user.
    #[arg(long, value_name = "NAME", requires = "edit")]
    author: Option<String>,
    /// Port to listen on; 0 selects a free one.
    #[arg(long, default_value_t = 0)]
    port: u16,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let program = this_program();
    let file = args.file.as_deref().map(|file| ViewedFile::open(&std::path::absolute(file)?, &program)).transpose()?;
    let project = if file.is_none() { Some(Project::open(args.config.load()?)?) } else { None };
    let user = || std::env::var("USER").ok().filter(|name| !name.is_empty()).unwrap_or_else(|| "unknown".to_owned());
    let author = args.edit.then(|| args.author.unwrap_or_else(user));
    let is_valid = |name: &String| name.chars().count() <= MAX_CHARS && !name.contains(char::is_control);
    ensure!(author.as_ref().is_none_or(is_valid), "--author: expected at most {MAX_CHARS} characters on one line");
    let request = ViewRequest { project, file, live: None, author, program };
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, args.port));
    view_server::run(request, address, |url| {
        ui.summary(&format!("open {url}\nCtrl-C ends the server"), None, json!({ "address": url }));
    })?;
    Ok(Outcome::Done)
}
