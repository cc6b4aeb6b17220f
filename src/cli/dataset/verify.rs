//! `orator dataset`: contents and integrity of a dataset, and its annotations.

use super::annotate;
use super::import::{train_gan, verify_deep};
use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::stage::rejection::Rejection;
use orator_base::text::{counted, length, number};
use orator_dataset::config::SplitUnit;
use orator_dataset::split::SplitRule;
use orator_dataset::verify::verify::{self, read_ledgers};
use orator_dataset::{Dataset, Split};
use serde_json::json;
use std::path::PathBuf;

/// Verify, describe or annotate a finished dataset.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: DatasetVerb,
}

#[derive(clap::Subcommand)]
enum DatasetVerb {
    /// Verify files, sizes, counts and checksums of a dataset.
    ///
    /// Each second of every video must also be accepted, rejected with a reason, or failed. Exit code 1: a problem was
    /// found.
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
    Annotate(annotate::Args),
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    if let DatasetVerb::Verify { dir, .. } | DatasetVerb::Info { dir } = &args.verb {
        enter_sandbox([], [dir.as_path()]);
    }
    match args.verb {
        DatasetVerb::Verify { dir, deep } => check(&dir, deep, ui),
        DatasetVerb::Info { dir } => info(&dir, ui),
        DatasetVerb::Annotate(args) => annotate::run(&args, ui),
    }
}

fn check(dir: &std::path::Path, deep: bool, ui: &Ui) -> Result<Outcome> {
    let found = verify::verify(dir, deep, ui)?;
    let is_valid = found.problems.is_empty();
    let mut lines: Vec<String> =
        found.problems.iter().map(|problem| format!("error   {}: {}", problem.file, problem.message)).collect();
    lines.push(format!(
        "{}: {}, {}, {}, {} of motion; {} MB read; {}",
        if is_valid { "valid" } else { "INVALID" },
        counted(found.n_files, "file"),
        counted(found.n_videos, "video"),
        counted(found.n_samples, "interval"),
        length(found.secs),
        found.bytes / 1_000_000,
        counted(found.problems.len(), "problem")
    ));
    let next = match (is_valid, deep) {
        (true, false) => verify_deep(dir),
        (true, true) => train_gan(dir),
        (false, _) => "orator run --from dataset --force".to_owned(),
    };
    let problems: Vec<_> = found.problems.iter().map(|p| json!({ "file": p.file, "message": p.message })).collect();
    let facts = json!({
        "valid": is_valid, "deep": deep, "problems": problems, "files": found.n_files, "videos": found.n_videos,
        "samples": found.n_samples, "secs": found.secs, "bytes_read": found.bytes, "next": next,
    });
    ui.summary(&lines.join("\n"), Some(&next), facts);
    Ok(if is_valid { Outcome::Done } else { Outcome::CheckFailed })
}

fn info(dir: &std::path::Path, ui: &Ui) -> Result<Outcome> {
    let dataset = Dataset::open(dir)?;
    let (info, stats) = (dataset.info(), dataset.stats());
    let or_not_stated = |text: &str| if text.is_empty() { "not stated".to_owned() } else { text.to_owned() };
    let mut lines = vec![
        format!("{}, {}, created by {}", info.speaker, info.fps, info.tool),
        format!(
            "licence {}, consent {}, source {}",
            or_not_stated(&info.licence),
            or_not_stated(&info.consent),
            or_not_stated(&info.source)
        ),
    ];
    if let Some(SplitRule { unit, why, guard_secs }) = &info.split_rule {
        lines.push(match unit {
            SplitUnit::Time => format!("splits by time, with gaps of {} s ({why})", number(*guard_secs)),
            SplitUnit::Video | SplitUnit::Auto => format!("splits by video ({why})"),
        });
    }
    for split in Split::ALL {
        let part = info.splits.get(split.name()).cloned().unwrap_or_default();
        let windows = stats.windows.strided.get(split.name()).copied().unwrap_or(0);
        lines.push(format!(
            "{:11} {:>9}, {} of {}, {} of {}, {}",
            split.name(),
            length(part.secs),
            counted(part.samples, "interval"),
            counted(part.videos.len(), "video"),
            counted(windows, "window"),
            counted(stats.windows.n_frames, "frame"),
            counted(part.shards.len(), "shard")
        ));
    }
    let footage = &stats.footage;
    lines.push(format!("accepted {} of {} of video", length(footage.accepted_secs), length(footage.secs)));
    let words =
        footage.words.map(|words| format!("{} of {} in samples", words.n_accepted, counted(words.n_words, "word")));
    lines.extend(words);
    lines.extend(
        footage
            .rejected_secs
            .iter()
            .map(|(reason, secs)| format!("  rejected, {}: {}", Rejection::label(reason), length(*secs))),
    );
    lines.push(format!(
        "  failed: {}, and {} of unknown duration",
        length(footage.failed_secs),
        counted(footage.n_of_unknown_length, "video")
    ));
    for account in read_ledgers(dir)? {
        lines.push(format!(
            "  {:40} {:10} accepted {:7.1} of {:7.1} s{}",
            account.name,
            account.split.map_or(if account.blocks.is_empty() { "-" } else { "by time" }, Split::name),
            account.ledger.accepted_secs(),
            account.ledger.duration_secs,
            account.failure.map(|failure| format!("; {failure}")).unwrap_or_default()
        ));
    }
    let next = train_gan(dir);
    ui.summary(&lines.join("\n"), Some(&next), json!({ "info": info, "stats": stats, "next": next }));
    Ok(Outcome::Done)
}
