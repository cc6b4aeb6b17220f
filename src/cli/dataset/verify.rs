//! `orator dataset`: contents and integrity of a dataset.

use super::import::{train_gan, verify_deep};
use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_dataset::config::SplitUnit;
use orator_dataset::split::SplitRule;
use orator_dataset::verify::verify::{self, read_ledgers};
use orator_dataset::{Dataset, Split};
use serde_json::json;
use std::path::PathBuf;

/// Verify or describe a finished dataset.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: DatasetVerb,
}

#[derive(clap::Subcommand)]
enum DatasetVerb {
    /// Verify files, sizes, counts and checksums of a dataset.
    ///
    /// Every second of every video must also be accounted for. Exit code 1: the dataset differs from what was
    /// written.
    Verify {
        /// Dataset folder, such as work/dataset/SPEAKER.
        dir: PathBuf,
        /// Read everything: check all hashes, shapes and values of arrays, and bone lengths.
        #[arg(long)]
        deep: bool,
    },
    /// Describe a dataset: splits, hours, rejected seconds by reason, and each video.
    Info {
        /// Dataset folder, such as work/dataset/SPEAKER.
        dir: PathBuf,
    },
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let (DatasetVerb::Verify { dir, .. } | DatasetVerb::Info { dir }) = &args.verb;
    enter_sandbox([], [dir.as_path()]);
    match args.verb {
        DatasetVerb::Verify { dir, deep } => check(&dir, deep, ui),
        DatasetVerb::Info { dir } => info(&dir, ui),
    }
}

fn check(dir: &std::path::Path, deep: bool, ui: &Ui) -> Result<Outcome> {
    let found = verify::verify(dir, deep, ui)?;
    let good = found.problems.is_empty();
    let mut lines: Vec<String> =
        found.problems.iter().map(|problem| format!("wrong   {}: {}", problem.file, problem.message)).collect();
    lines.push(format!(
        "{}: {} files, {} videos, {} intervals, {:.1} s of motion; {} MB read; {}",
        if good { "sound" } else { "NOT SOUND" },
        found.n_files,
        found.n_videos,
        found.n_samples,
        found.secs,
        found.bytes / 1_000_000,
        if good { "nothing wrong".to_owned() } else { format!("{} things wrong", found.problems.len()) }
    ));
    let next = match (good, deep) {
        (true, false) => verify_deep(dir),
        (true, true) => train_gan(dir),
        (false, _) => "orator run --from dataset --force".to_owned(),
    };
    let problems: Vec<_> = found.problems.iter().map(|p| json!({ "file": p.file, "message": p.message })).collect();
    let facts = json!({
        "sound": good, "deep": deep, "problems": problems, "files": found.n_files, "videos": found.n_videos,
        "samples": found.n_samples, "secs": found.secs, "bytes_read": found.bytes, "next": next,
    });
    ui.summary(&lines.join("\n"), Some(&next), facts);
    Ok(if good { Outcome::Done } else { Outcome::Wrong })
}

fn info(dir: &std::path::Path, ui: &Ui) -> Result<Outcome> {
    let dataset = Dataset::open(dir)?;
    let (info, stats) = (dataset.info(), dataset.stats());
    let or_not_said = |text: &str| if text.is_empty() { "not said".to_owned() } else { text.to_owned() };
    let mut lines = vec![
        format!("{} at {}, made by {}", info.speaker, info.fps, info.tool),
        format!(
            "licence {}, consent {}, source {}",
            or_not_said(&info.licence),
            or_not_said(&info.consent),
            or_not_said(&info.source)
        ),
    ];
    if let Some(SplitRule { unit, why, guard_secs }) = &info.split_rule {
        lines.push(match unit {
            SplitUnit::Time => format!("splits by time, {guard_secs:.2} s apart ({why})"),
            SplitUnit::Video | SplitUnit::Auto => format!("splits by video ({why})"),
        });
    }
    for split in Split::ALL {
        let part = info.splits.get(split.name()).cloned().unwrap_or_default();
        let windows = stats.windows.strided.get(split.name()).copied().unwrap_or(0);
        lines.push(format!(
            "{:11} {:9.1} s, {} intervals of {} videos, {windows} windows of {} frames, {} shards",
            split.name(),
            part.secs,
            part.samples,
            part.videos.len(),
            stats.windows.n_frames,
            part.shards.len()
        ));
    }
    let footage = &stats.footage;
    lines.push(format!("of {:.1} s of video: kept {:.1}", footage.secs, footage.kept_secs));
    lines.extend(footage.refused_secs.iter().map(|(reason, secs)| format!("  refused, {reason}: {secs:.1} s")));
    lines.push(format!(
        "  failed: {:.1} s, and {} videos of unknown length",
        footage.failed_secs, footage.n_of_unknown_length
    ));
    for account in read_ledgers(dir)? {
        lines.push(format!(
            "  {:40} {:10} kept {:7.1} of {:7.1} s{}",
            account.name,
            account.split.map_or(if account.blocks.is_empty() { "-" } else { "by time" }, Split::name),
            account.ledger.kept_secs(),
            account.ledger.duration_secs,
            account.failure.map(|failure| format!("; {failure}")).unwrap_or_default()
        ));
    }
    let next = train_gan(dir);
    ui.summary(&lines.join("\n"), Some(&next), json!({ "info": info, "stats": stats, "next": next }));
    Ok(Outcome::Done)
}
