//! `orator dataset annotate`.

use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::signals;
use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use orator_base::text::{counted, number, percent};
use orator_dataset::Dataset;
use orator_gesture::phases::annotations::{PHASES, annotate};
use orator_gesture::phases::{HANDS, PhaseKind, PhaseTotals};
use serde_json::json;
use std::path::{Component, Path, PathBuf};

/// Write gesture phases, words and rejected seconds for ELAN and as a table.
///
/// Strokes, retractions, holds and rests of each hand are found in the 3D joints (`orator guide dataset`). FOLDER gets
/// `phases.csv` with the times, confidence and kinematics of all phases, and `VIDEO.eaf` for each video.
#[derive(clap::Args)]
pub struct Args {
    /// Dataset folder, such as work/dataset/SPEAKER.
    dir: PathBuf,
    /// Folder for the files.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Folder with the videos, for the links to them; by default they are expected in the folder of --out.
    #[arg(long, value_name = "FOLDER")]
    videos: Option<PathBuf>,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let Args { dir, out, videos } = args;
    ensure!(!out.is_file(), "{} is a file: expected a folder (--out)", out.display());
    let is_inside = absolute(out)?.starts_with(absolute(dir)?);
    ensure!(!is_inside, "{} is in the dataset: choose another folder (--out)", out.display());
    let links = videos.as_deref().map(|videos| relative(videos, out)).transpose()?;
    enter_sandbox([out.join(PHASES).as_path()], [dir.as_path()]);
    signals::exit_on_signal("annotations that were written are complete");
    let media = |file: &str| -> Result<String> {
        let (Some(videos), Some(link)) = (videos, &links) else { return Ok(file.to_owned()) };
        ensure!(
            videos.join(file).is_file(),
            "{} has no {file}: expected the folder with the videos of the dataset (--videos)",
            videos.display()
        );
        Ok(link.join(file).to_string_lossy().into_owned())
    };
    let totals = annotate(&Dataset::open(dir)?, out, media, ui)?;
    let mut lines: Vec<String> = totals.hands.iter().zip(HANDS).map(|(hand, (_, name))| line(name, hand)).collect();
    if totals.n_with_words > 0 {
        let share = percent(totals.n_bound as f64, totals.n_with_words as f64);
        lines.push(format!("{share} of the strokes in samples with words are bound to a word"));
    }
    let table = out.join(PHASES);
    lines.push(format!("{}: {}", counted(totals.n_videos, "ELAN file"), out.display()));
    lines.push(format!("all phases: {}", table.display()));
    let facts = json!({
        "videos": totals.n_videos, "table": table, "strokes": totals.hands.each_ref().map(PhaseTotals::n_strokes),
        "strokes_with_words": totals.n_with_words, "strokes_bound_to_words": totals.n_bound,
    });
    ui.summary(&lines.join("\n"), None, facts);
    Ok(Outcome::Done)
}

/// Line of the summary for a hand.
fn line(name: &str, hand: &PhaseTotals) -> String {
    let shares = PhaseKind::ALL.map(|kind| format!("{} {}", percent(hand.share(kind), 1.0), kind.name()));
    let rate = number((10.0 * hand.strokes_per_minute()).round() / 10.0);
    format!("{name:5} {} ({rate} a minute); {}", counted(hand.n_strokes(), "stroke"), shares.join(", "))
}

/// The path without links and `..`; its last folders may not exist yet.
fn absolute(path: &Path) -> Result<PathBuf> {
    let full = std::path::absolute(path)?;
    let existing = full.ancestors().find(|folder| folder.exists()).unwrap_or(Path::new("/"));
    let mut found = existing.canonicalize()?;
    for part in full.strip_prefix(existing)?.components() {
        match part {
            Component::ParentDir => drop(found.pop()),
            part => found.push(part),
        }
    }
    Ok(found)
}

/// Path of the existing folder `to`, relative to the folder `from`.
fn relative(to: &Path, from: &Path) -> Result<PathBuf> {
    ensure!(to.is_dir(), "{} is not a folder: expected the folder with the videos (--videos)", to.display());
    let (to, from) = (absolute(to)?, absolute(from)?);
    let n_common = to.components().zip(from.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(n_common).map(|_| Path::new(".."));
    Ok(up.chain(to.components().skip(n_common).map(|part| Path::new(part.as_os_str()))).collect())
}
