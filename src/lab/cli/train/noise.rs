//! `orator-lab train noise`.

use crate::evaluate::people::{clips, hand_noise, noise};
use crate::train::scene::noise::MeasuredNoise;
use anyhow::{Result, ensure};
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::stage::workdir;
use serde_json::json;
use std::path::PathBuf;

/// Fit the noise model for lifter training to 2D errors on rendered persons.
///
/// The model has a bias that depends on the orientation of the bones in the image, a residual bias per clip, noise
/// per frame, outliers and gaps, each for visible and for hidden points.
#[derive(clap::Args)]
pub struct Args {
    /// Folder written by `orator-lab demo draw --people`.
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// Configuration files of the runs to measure, one per model set.
    #[arg(short, long, value_name = "FILE", num_args = 1.., required = true)]
    config: Vec<PathBuf>,
    /// Part of the clips to fit to: first, middle or last.
    #[arg(long, value_name = "PART", default_value = "first")]
    part: String,
    /// File to write.
    #[arg(long, value_name = "FILE.json")]
    out: PathBuf,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    ensure!(!args.out.is_dir(), "invalid --out {}: it is a folder, expected a file", args.out.display());
    let mut measured = MeasuredNoise { bodies: Vec::new(), hands: Vec::new() };
    for file in &args.config {
        let clips = clips::read(&args.dir, file, Some(&args.part), &[])?;
        let set = file.file_stem().unwrap_or_default().to_string_lossy();
        measured.bodies.push(noise::fit(&set, &clips));
        measured.hands.push(hand_noise::fit(&set, &clips));
    }
    let text = serde_json::to_string_pretty(&measured)? + "\n";
    workdir::write_file(&args.out, text.as_bytes())?;
    ui.summary(&format!("wrote {}", args.out.display()), None, json!({ "out": args.out, "noise": measured }));
    Ok(Outcome::Done)
}
