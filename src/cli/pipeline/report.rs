//! `orator report`.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::stage::artifacts;
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::text::{length, percent};
use orator_pipeline::Pipeline;
use orator_report as report;
use orator_report::ReportRequest;
use serde_json::json;
use std::path::PathBuf;

/// Write an HTML report: which seconds were accepted or rejected, and why.
///
/// The report contains a timeline of each video, the worst frames of each rule, the distributions of the measured
/// values, sliders that show what other thresholds would accept, and statistics of the joint motion. The page is a
/// single file and needs no network.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Report only on this speaker; may be repeated.
    #[arg(long, value_name = "NAME")]
    speaker: Vec<String>,
    /// HTML page to write; defaults to report.html in the work folder.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Maximum number of example frames per rule; with 0 no video is read.
    #[arg(long, default_value_t = 6, value_name = "N")]
    pictures: usize,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let pipeline = Pipeline::open(args.config.load()?)?;
    let (videos, settings) = (pipeline.videos(&args.speaker)?, &pipeline.config().settings);
    let _lock = FolderLock::shared(&settings.work.dir)?;
    let out = args.out.unwrap_or_else(|| settings.work.dir.join("report.html"));
    enter_sandbox([out.as_path(), &artifacts::hashes(&settings.work.dir)], [&*settings.work.dir]);
    let request = ReportRequest { settings, videos: &videos, n_pictures: args.pictures };
    let page = report::make(&request, ui);
    workdir::write_file(&out, page.html.as_bytes())?;
    let (sums, mut facts) = (page.sums, page.facts);
    let text = format!(
        "accepted {} of {} ({}), rejected {}, failed {}\nwrote {} ({:.1} MB)",
        length(sums.accepted),
        length(sums.total),
        percent(sums.accepted, sums.total),
        length(sums.rejected_secs()),
        length(sums.failed),
        out.display(),
        page.html.len() as f64 / 1e6
    );
    let next = format!("xdg-open {}", out.display());
    facts["report"] = json!(out);
    facts["bytes"] = json!(page.html.len());
    facts["next"] = json!(next);
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}
