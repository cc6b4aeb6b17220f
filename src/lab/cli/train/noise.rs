//! `orator-lab train noise`.

use crate::evaluate::people::{clips, hand_noise, noise};
use crate::train::scene::noise::MeasuredNoise;
use anyhow::{Result, ensure};
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::stage::workdir;
use serde_json::json;
use std::path::PathBuf;

/// Fit the errors of 2D models on rendered people as the noise by which lifters are trained.
///
/// Bias by how the bones lie in the picture, its rest by clip, noise of frames, strays, gaps; of points seen and hidden.
#[derive(clap::Args)]
pub struct Args {
    /// A folder of `orator-lab demo draw --people`.
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// Configurations whose runs are measured, each a model set.
    #[arg(short, long, value_name = "FILE", num_args = 1.., required = true)]
    config: Vec<PathBuf>,
    /// The clips to learn from: first, middle or last part.
    #[arg(long, value_name = "PART", default_value = "first")]
    part: String,
    /// The file to write.
    #[arg(long, value_name = "FILE.json")]
    out: PathBuf,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    ensure!(!args.out.is_dir(), "{} is a folder; name a file", args.out.display());
    let mut measured = MeasuredNoise { bodies: Vec::new(), hands: Vec::new() };
    for file in &args.config {
        let clips = clips::read(&args.dir, file, Some(&args.part))?;
        let set = file.file_stem().unwrap_or_default().to_string_lossy();
        measured.bodies.push(noise::fit(&set, &clips));
        measured.hands.push(hand_noise::fit(&set, &clips));
    }
    let text = serde_json::to_string_pretty(&measured)? + "\n";
    workdir::write_file(&args.out, text.as_bytes())?;
    ui.summary(&format!("{} written", args.out.display()), None, json!({ "out": args.out, "noise": measured }));
    Ok(Outcome::Done)
}
