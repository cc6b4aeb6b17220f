//! `cargo bench -- spaces`.

use super::disturbed::{self, Disturbance};
use super::report::{Report, median};
use anyhow::{Context, Result, ensure};
use ndarray::{ArrayView3, Axis, concatenate};
use orator_base::stage::progress::Progress;
use orator_base::types::pose3d::Motion;
use orator_base::types::split::Split;
use orator_dataset::Dataset;
use orator_gesture::metrics::space::{basis, embedding};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// What the spaces of the Frechet gesture distance notice: ground truth made worse in known ways, and its distance from
/// other ground truth in raw poses, in the fixed basis and in the trained embedding; and how long an hour takes. Without
/// --dataset the motion is the synthetic speaker's.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Minutes of the synthetic speaker, half of them disturbed.
    #[arg(long, default_value_t = 20, value_name = "N")]
    minutes: usize,
    /// The training split of this dataset instead.
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Rounds of the timing.
    #[arg(long, default_value_t = 3, value_name = "N")]
    rounds: usize,
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!((2..=600).contains(&args.minutes), "--minutes is {}, expected 2 to 600", args.minutes);
    ensure!(args.rounds > 0, "--rounds is 0, expected at least 1");
    let task = progress.begin("spaces", 0);
    let motions = match &args.dataset {
        None => disturbed::unseen(args.minutes)?,
        Some(folder) => {
            let dataset = Dataset::open(folder)?;
            let samples = dataset.samples(Split::Train);
            samples.iter().map(|sample| Ok(dataset.read(sample)?.motion)).collect::<Result<_>>()?
        }
    };
    ensure!(motions.len() >= 2, "the motion has no two parts to compare");
    task.detail("disturbing");
    let rows = disturbed::table(&motions);
    let floor = rows.iter().find(|row| row.disturbance == Disturbance::None).context("no floor")?.distances;
    let mut text = format!("{:28}{:>22}{:>22}{:>22}\n", "disturbance", "raw poses, cm²", "basis", "embedding");
    for row in &rows {
        text += &format!("{:28}", row.disturbance.to_string());
        for (distance, floor) in row.distances.iter().zip(floor) {
            text += &format!("{distance:>12.3} ({:>6.1}x)", distance / floor);
        }
        text += "\n";
    }
    text += "in brackets: times the distance of undisturbed halves\n";
    task.detail("timing an hour");
    let views: Vec<ArrayView3<f32>> =
        motions.iter().cycle().map(|motion| motion.joints.view()).scan(0, until_an_hour).collect();
    let hour = concatenate(Axis(0), &views)?;
    let hour = Motion::from_joints(motions[0].fps, hour);
    let secs = hour.fps.secs(hour.n_frames());
    let timed = |of: &dyn Fn() -> usize| {
        let mut n = 0;
        let rounds = (0..args.rounds).map(|_| {
            let start = Instant::now();
            n = of();
            start.elapsed().as_secs_f64()
        });
        (median(rounds.collect()), n)
    };
    let (joints, mask) = (hour.joints.view(), hour.mask.view());
    let of_basis = timed(&|| basis::windows(joints, mask, hour.fps).nrows());
    let of_embedding = timed(&|| embedding::windows(joints, mask, hour.fps).nrows());
    for (name, (took, n)) in [("basis", of_basis), ("embedding", of_embedding)] {
        text += &format!("{name:10} {n:6} windows of {secs:.0} s in {took:.2} s\n");
    }
    text += &format!("basis {}\nembedding {}", basis::hash(), embedding::hash());
    let table: Vec<_> = rows
        .iter()
        .map(|row| json!({ "disturbance": row.disturbance.to_string(), "distances": row.distances }))
        .collect();
    let facts = json!({
        "rows": table, "motion_secs": secs, "basis_secs": of_basis.0, "embedding_secs": of_embedding.0,
        "basis": basis::hash(), "embedding": embedding::hash(),
    });
    drop(task);
    Ok(Report { text, facts })
}

/// Motion goes on until there is an hour of it.
fn until_an_hour<'a>(n: &mut usize, joints: ArrayView3<'a, f32>) -> Option<ArrayView3<'a, f32>> {
    const HOUR: usize = 54_000;
    let before = *n;
    *n += joints.shape()[0].max(1);
    (before < HOUR).then(|| joints.slice_move(ndarray::s![..(HOUR - before).min(joints.shape()[0]), .., ..]))
}
