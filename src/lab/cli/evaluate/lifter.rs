//! `orator-lab evaluate lifter`.

use crate::cli::train::lifter::LifterPart;
use crate::evaluate::lifter::{bodies, hands};
use crate::mocap::fingers::files;
use crate::mocap::upper_body;
use anyhow::{Context, Result, ensure};
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_dataset::config;
use std::path::PathBuf;

/// Measure lifter errors on captured motion projected by random cameras.
///
/// Errors of trivial baselines are printed next to them.
#[derive(clap::Args)]
pub struct Args {
    /// Lifter to measure.
    #[arg(long, value_enum, default_value = "body")]
    part: LifterPart,
    /// Captured motion: files or folders. body: .bvh, CMU or TED .npz; hands: .bvh with fingers, TED .npz, ICVL or
    /// NYU label .txt, and people.json of `orator-lab demo draw --people` (middle part).
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    mocap: Vec<PathBuf>,
    /// body: measure only the takes that match these patterns, each as a separate set, such as 'test_*' or 'walk#1'
    /// (the second take of a file); defaults to all takes as one set.
    #[arg(long, value_name = "PATTERN", num_args = 1..)]
    takes: Vec<String>,
    /// body: number of scenes of 4 s per set.
    #[arg(long, value_name = "N", default_value_t = bodies::SCENES)]
    scenes: usize,
    /// Weights written by `orator-lab train lifter --part body`; defaults to the built-in ones.
    #[arg(long, value_name = "FILE")]
    body_weights: Option<PathBuf>,
    /// hands: weights written by `orator-lab train lifter --part hands`, of either network, to measure next to the
    /// built-in ones.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    hand_weights: Vec<PathBuf>,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.part {
        LifterPart::Body => body(args, ui),
        LifterPart::Hands => hands(args, ui),
    }
}

fn body(args: Args, ui: &Ui) -> Result<Outcome> {
    ensure!((1..=100_000).contains(&args.scenes), "invalid --scenes {}: expected 1 to 100000", args.scenes);
    let settings = config::LiftConfig { body_weights: args.body_weights.unwrap_or_default(), ..Default::default() };
    let takes = upper_body::read_all(&args.mocap).context("cannot read --mocap")?;
    let sets = if args.takes.is_empty() {
        vec![("all takes".to_owned(), takes)]
    } else {
        upper_body::divide(takes, &args.takes)?.0
    };
    let rows = bodies::table(&bodies::Lifters::new(&settings)?, &sets, args.scenes)?;
    ui.summary(&bodies::text(&rows), None, serde_json::json!({ "body": rows }));
    Ok(Outcome::Done)
}

fn hands(args: Args, ui: &Ui) -> Result<Outcome> {
    let weights = [PathBuf::new()].into_iter().chain(args.hand_weights);
    let lifters = weights.map(|path| hands::lifter_of(&path)).collect::<Result<Vec<_>>>()?;
    let rows = hands::evaluate(&lifters, &files::read_all(&args.mocap)?, hands::MEASURED, 1)?;
    ui.summary(&hands::text(&rows), None, serde_json::json!({ "hands": rows }));
    Ok(Outcome::Done)
}
