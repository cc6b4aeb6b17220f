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

/// Sensitivity of the Frechet gesture distance to known disturbances of ground-truth motion: the distance from other
/// ground truth in raw poses, in the fixed basis and in the trained embedding; and the time for one hour of motion.
/// Without --dataset the motion is that of the synthetic speaker.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Minutes of motion of the synthetic speaker; half of them are disturbed.
    #[arg(long, default_value_t = 20, value_name = "N")]
    minutes: usize,
    /// Use the training split of this dataset instead.
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Rounds of the time measurement.
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
    ensure!(motions.len() >= 2, "the motion has fewer than two parts to compare");
    task.detail("disturbing");
    let rows = disturbed::table(&motions);
    let floor =
        rows.iter().find(|row| row.disturbance == Disturbance::None).context("no row without disturbance")?.distances;
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
    let timed = |work: &dyn Fn() -> usize| {
        let mut n = 0;
        let rounds = (0..args.rounds).map(|_| {
            let start = Instant::now();
            n = work();
            start.elapsed().as_secs_f64()
        });
        (median(rounds.collect()), n)
    };
    let (joints, mask) = (hour.joints.view(), hour.mask.view());
    let basis_time = timed(&|| basis::windows(joints, mask, hour.fps).nrows());
    let embedding_time = timed(&|| embedding::windows(joints, mask, hour.fps).nrows());
    for (name, (took, n)) in [("basis", basis_time), ("embedding", embedding_time)] {
        text += &format!("{name:10} {n:6} windows of {secs:.0} s in {took:.2} s\n");
    }
    text += &format!("basis {}\nembedding {}", basis::hash(), embedding::hash());
    let table: Vec<_> = rows
        .iter()
        .map(|row| json!({ "disturbance": row.disturbance.to_string(), "distances": row.distances }))
        .collect();
    let facts = json!({
        "rows": table, "motion_secs": secs, "basis_secs": basis_time.0, "embedding_secs": embedding_time.0,
        "basis": basis::hash(), "embedding": embedding::hash(),
    });
    drop(task);
    Ok(Report { text, facts })
}

/// Step of a scan that ends after one hour of motion; `n` counts the frames.
fn until_an_hour<'a>(n: &mut usize, joints: ArrayView3<'a, f32>) -> Option<ArrayView3<'a, f32>> {
    const HOUR: usize = 54_000;
    let before = *n;
    *n += joints.shape()[0].max(1);
    (before < HOUR).then(|| joints.slice_move(ndarray::s![..(HOUR - before).min(joints.shape()[0]), .., ..]))
}
