//! `cargo bench -- evaluate`.

use super::child;
use super::report::Report;
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3};
use orator_base::stage::progress::{Progress, Task};
use orator_base::types::sound::Sound;
use orator_base::types::split::Split;
use orator_base::types::time::FrameRate;
use orator_gesture::evaluate::baseline::baselines;
use orator_gesture::evaluate::baseline::baselines::Predictor;
use orator_gesture::evaluate::clips::clips::{EvalClip, EvalClips, compared};
use orator_gesture::evaluate::clips::motion_store::{MotionStore, StoredMotion};
use orator_gesture::evaluate::clips::sound_features;
use orator_gesture::evaluate::conclusion::text;
use orator_gesture::evaluate::table::{result, table};
use orator_gesture::metrics::settings::MetricSettings;
use orator_report::evaluation::page;
use orator_test_support::rule::dataset::{RULE, SpokenClip as Rule};
use rayon::prelude::*;
use serde_json::json;
use std::sync::Mutex;
use std::time::Instant;

/// Evaluation of predicted motion against the ground truth, in memory: all metrics, baselines and bootstrap draws, and
/// the report page. Measures the time of each part and the peak memory. Motion and audio are those of the synthetic
/// speaker at 15 fps.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Hours of motion.
    #[arg(long, default_value_t = 1.0, value_name = "HOURS")]
    hours: f64,
    /// Number of clips into which the motion is cut.
    #[arg(long, default_value_t = 60, value_name = "N")]
    clips: usize,
    /// Threads.
    #[arg(long, default_value_t = 2, value_name = "N")]
    threads: usize,
}

const FPS: FrameRate = FrameRate::new(15, 1);

/// Start time of each part.
#[derive(Default)]
struct Stopwatch(Mutex<Vec<(String, Instant)>>);

impl Task for Stopwatch {
    fn advance(&self, _steps: u64) {}
    fn detail(&self, text: &str) {
        if let Ok(mut parts) = self.0.lock() {
            parts.push((text.to_owned(), Instant::now()));
        }
    }
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.hours > 0.0 && args.hours <= 24.0, "--hours is {}, expected up to 24", args.hours);
    ensure!(args.clips > 0 && args.threads > 0, "nothing to measure: there must be clips and threads");
    let n_frames = (args.hours * 3600.0 * FPS.per_sec()) as usize / args.clips;
    ensure!(n_frames > 15, "{} clips of {n_frames} frames are too short", args.clips);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?;
    let task = progress.begin("evaluate", 0);
    task.detail("making the speaker");
    let speaker = pool.install(|| speaker(args.clips, n_frames));
    let (before_mib, before_cpu) = (child::own_peak_mib(), child::own_cpu_secs());
    let watch = Stopwatch::default();
    task.detail("evaluating");
    let (table, html) = pool.install(|| evaluate(speaker, &watch))?;
    watch.detail("");
    drop(task);

    let parts = watch.0.into_inner().unwrap_or_default();
    let secs = |a: &(String, Instant), b: &(String, Instant)| b.1.duration_since(a.1).as_secs_f64();
    let times: Vec<(&str, f64)> = parts.windows(2).map(|two| (two[0].0.as_str(), secs(&two[0], &two[1]))).collect();
    let total: f64 = times.iter().map(|(_, secs)| secs).sum();
    let peak = child::own_peak_mib();
    let mut lines = vec![format!(
        "{:.2} h of motion in {} clips, {} figures, {} blocks, {} threads",
        args.hours,
        args.clips,
        table.definitions.len(),
        table.n_blocks,
        args.threads
    )];
    lines.extend(times.iter().map(|(part, secs)| format!("{part:24}{secs:8.2} s")));
    let cpu = child::own_cpu_secs() - before_cpu;
    lines.push(format!("{:24}{total:8.2} s, {cpu:.1} s of processor time", "all"));
    lines.push(format!(
        "page {:.1} MB; peak memory {peak:.0} MiB, of that before evaluation {before_mib:.0} MiB",
        html.len() as f64 / 1e6
    ));
    let facts = json!({
        "hours": args.hours,
        "secs": total,
        "cpu_secs": cpu,
        "parts": times.iter().map(|(part, secs)| json!({ "part": part, "secs": secs })).collect::<Vec<_>>(),
        "peak_mib": peak,
        "n_blocks": table.n_blocks,
        "n_figures": table.definitions.len(),
    });
    Ok(Report { text: lines.join("\n"), facts })
}

/// A clip without audio features.
struct RawClip {
    ground_truth: Array3<f32>,
    mask: Array2<bool>,
    predicted: Array3<f32>,
    sound: Sound,
}

/// Clips of the synthetic speaker: the ground truth has random variation, the prediction follows only the rule.
fn speaker(n_clips: usize, n_frames: usize) -> Vec<RawClip> {
    let clip = |number: usize| {
        let rule = Rule { rule: RULE, seed: 1, split: Split::Validation, number, n_frames, habits: 0 };
        let ground_truth = rule.motion();
        RawClip {
            mask: ground_truth.mask,
            ground_truth: ground_truth.joints,
            predicted: rule.predictable().joints,
            sound: rule.sound(),
        }
    };
    (0..n_clips).into_par_iter().map(clip).collect()
}

fn evaluate(speaker: Vec<RawClip>, watch: &Stopwatch) -> Result<(table::Table, String)> {
    watch.detail("listening");
    let clip = |(number, raw): (usize, RawClip)| {
        let RawClip { ground_truth, mask, mut predicted, sound } = raw;
        let features = Some(sound_features::from_samples(&sound.samples, FPS, ground_truth.shape()[0]));
        let (mask, _) = compared(&ground_truth, &mask, &mut predicted);
        let (ground_truth, predicted) = (StoredMotion::Held(ground_truth), StoredMotion::Held(predicted));
        EvalClip { name: format!("clip {number}"), ground_truth, predicted, mask, features, audio: None }
    };
    let clips = speaker.into_par_iter().enumerate().map(clip).collect();
    let clips = EvalClips { fps: FPS, clips, notes: Vec::new(), trained_on: false, channels: Vec::new() };
    watch.detail("making the baselines");
    let mut predictors = vec![Predictor::prediction(&clips, "what the rule alone would do")];
    predictors.extend(baselines::from_files(&clips, &MotionStore::in_memory())?.0);
    let table = table::measure(&clips, &MetricSettings::default(), &predictors, watch)?;
    watch.detail("the verdict and the JSON");
    let length = text::text(&table, true).len() + result::json(&table).to_string().len();
    ensure!(length > 0, "the result is empty");
    watch.detail("the page");
    let html = page::html(&table, &clips, "bench", None)?;
    Ok((table, html))
}
