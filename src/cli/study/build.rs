//! `orator study build`.

use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::signals;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::text::counted;
use orator_study::build::{BuiltSpeaker, BuiltStudy, build};
use orator_study::file::{ConditionSource, StudyFile, fill_pattern};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Maximum number of rejected audio segments that are listed; `clips/clips.json` has all.
const MAX_LISTED: usize = 10;

/// Render the films of a study, assign them to sessions, and seal both.
///
/// This happens before the first participant. An interrupted build continues from the rendered films, and its result
/// is byte-identical to that of an uninterrupted one. A folder that is sealed or contains answers is not changed.
#[derive(clap::Args)]
pub struct Args {
    /// Study file; `orator guide study` shows an example.
    #[arg(value_name = "STUDY.toml")]
    study: PathBuf,
    /// Folder of the built study; defaults to the path of the study file without its extension.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let file = StudyFile::read(&args.study)?;
    let out = args.out.clone().unwrap_or_else(|| args.study.with_extension(""));
    // Writes are allowed in the output folder itself and for the locks of the inputs.
    let checkpoints = file.speaker.iter().flat_map(|speaker| {
        file.condition.iter().filter_map(|condition| match &condition.source {
            ConditionSource::Checkpoint(path) => Some(fill_pattern(path, &speaker.name, "")),
            _ => None,
        })
    });
    let datasets = file.speaker.iter().filter_map(|speaker| speaker.dataset.clone());
    let locked: Vec<PathBuf> = checkpoints.chain(datasets).collect();
    enter_sandbox([out.as_path()], locked.iter().map(PathBuf::as_path));
    signals::exit_on_signal("completed films are saved; run the same command again to continue");
    let built = build(&file, &out, file.films.layout.size(), ui)?;
    let next = format!("orator study serve {}", built.folder.display());
    let mut facts = json!(built);
    facts["next"] = json!(next);
    ui.summary(&text(&built), Some(&next), facts);
    Ok(Outcome::Done)
}

fn text(built: &BuiltStudy) -> String {
    let mut text = String::new();
    for BuiltSpeaker { name, clips, rejected } in &built.speakers {
        let hidden = clips.iter().filter(|clip| clip.hidden_share > 0.0).count();
        let loud = clips.iter().filter(|clip| !clip.ends_in_pauses()).count();
        let _ = write!(text, "{name}: {}", counted(clips.len(), "clip"));
        if hidden > 0 {
            let _ = write!(text, ", {hidden} with undetected joints, which are hidden in all conditions");
        }
        if loud > 0 {
            let _ = write!(text, ", {loud} cut during speech because pauses are missing");
        }
        text += "\n";
        for rejected in rejected.iter().take(MAX_LISTED) {
            let _ = writeln!(text, "  rejected {}: {}", rejected.name, rejected.reason);
        }
        if rejected.len() > MAX_LISTED {
            let _ = writeln!(text, "  and {}", counted(rejected.len() - MAX_LISTED, "more segment"));
        }
    }
    for line in &built.balance {
        let _ = writeln!(text, "{line}");
    }
    text + &format!(
        "{}, {} kB, {:.1} LUFS; {} of {} each\n{} {}; seal: {}",
        counted(built.n_films, "film"),
        built.film_bytes / 1000,
        built.loudness_lufs,
        counted(built.n_sessions, "session"),
        counted(built.n_trials, "trial"),
        if built.up_to_date { "already sealed:" } else { "sealed" },
        built.folder.display(),
        built.seal
    )
}
