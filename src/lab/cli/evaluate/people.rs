//! `orator-lab evaluate people`.

use crate::evaluate::people::page;
use crate::evaluate::people::{grid, keypoint_statistics, table};
use crate::mocap::captured::source::MotionSource;
use anyhow::Result;
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::stage::workdir;
use serde_json::json;
use std::path::PathBuf;

/// Measure the errors of a run on rendered persons, by condition or by source of the motion.
///
/// Compared with the ground truth: 2D keypoints, hands (missed, detected on the other hand, swapped, false positives),
/// falsely accepted and rejected seconds, and lifted joints. The errors of the joints are printed next to those of
/// the mean pose of the clip and of the same lifter with exact keypoints.
#[derive(clap::Args)]
pub struct Args {
    /// Folder written by `orator-lab demo draw --people`.
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// Configuration files of the runs to measure, one per model set; defaults to DIR/pipeline.toml.
    #[arg(short, long, value_name = "FILE", num_args = 1..)]
    config: Vec<PathBuf>,
    /// Measure only this part of the clips: first, middle or last.
    #[arg(long, value_name = "PART")]
    part: Option<String>,
    /// Measure only clips with motion of these sources: generated, cmu, bandai, beat2, ted. If there is captured
    /// motion, errors are printed by source, with the difference between captured and generated motion.
    #[arg(long, value_name = "SOURCE", num_args = 1..)]
    motion: Vec<MotionSource>,
    /// Configuration files of runs on real clips, whose keypoints are compared with the rendered ones: scores,
    /// jitter, detected hands.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    real: Vec<PathBuf>,
    /// Also write an HTML page.
    #[arg(long, value_name = "PAGE.html")]
    pub report: Option<PathBuf>,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let default = [args.dir.join("pipeline.toml")];
    let config: &[PathBuf] = if args.config.is_empty() { &default } else { &args.config };
    let rows = table::table(&args.dir, config, args.part.as_deref(), &args.motion)?;
    let files: Vec<&PathBuf> =
        if args.real.is_empty() { Vec::new() } else { config.iter().chain(&args.real).collect() };
    let statistics = files.into_iter().map(|file| keypoint_statistics::of_config(file)).collect::<Result<Vec<_>>>()?;
    let last = (!statistics.is_empty()).then(|| keypoint_statistics::grid(&statistics));
    let mut text = grid::text(&rows, last.as_ref());
    if let Some(path) = &args.report {
        workdir::write_file(path, page::html(&rows, last.as_ref()).as_bytes())?;
        text += &format!("\nwrote {}", path.display());
    }
    ui.summary(&text, None, json!({ "conditions": rows, "keypoints": statistics, "report": args.report }));
    Ok(Outcome::Done)
}
