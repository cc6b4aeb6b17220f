//! `cargo bench -- run`.

use super::child::{Child, measure};
use super::report::{Report, median};
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress;
use orator_dataset::config;
use serde_json::json;
use std::fs;
use std::path::PathBuf;

/// Processor use of `orator run`: all stages for the videos of a project, in a separate work folder.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Configuration of the project.
    #[arg(short, long, default_value = "pipeline.toml", value_name = "FILE")]
    config: PathBuf,
    /// Rounds.
    #[arg(long, default_value_t = 3, value_name = "N")]
    rounds: usize,
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.rounds > 0, "nothing to measure: there must be a round");
    let config = config::load(&args.config, &[])?;
    let folder = config.file.parent().context("the configuration file has no parent folder")?;
    let work = folder.join(format!("bench-{}", std::process::id()));
    let (file, set) = (config.file.display().to_string(), format!("work.dir={}", work.display()));
    let task = progress.begin("run", args.rounds as u64);
    let mut rounds: Vec<Child> = Vec::new();
    for _ in 0..args.rounds {
        let measured = measure(folder, &["run", "-c", &file, "--set", &set]);
        let _ = fs::remove_dir_all(&work);
        rounds.push(measured?);
        task.advance(1);
    }
    drop(task);
    let n_cores = std::thread::available_parallelism().map_or(1, |n| n.get()) as f64;
    let median_of = |value: fn(&Child) -> f64| median(rounds.iter().map(value).collect());
    let (secs, used, busy) =
        (median_of(|c| c.secs), median_of(|c| c.cpu_secs / c.secs) / n_cores, median_of(|c| c.busy) / n_cores);
    let text = format!(
        "orator run: {secs:.1} s, median of {} rounds, {n_cores} cores\n\
         processor time      {:5.1} % of the cores\n\
         threads to run      {:5.1} % of the cores: what would be used on a machine that does nothing else",
        args.rounds,
        100.0 * used,
        100.0 * busy
    );
    Ok(Report { text, facts: json!({ "secs": secs, "used": used, "busy": busy, "cores": n_cores }) })
}
