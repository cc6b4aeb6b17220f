//! `orator import`.

use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use clap::ValueEnum;
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::text::{counted, length};
use orator_base::types::time::FrameRate;
use orator_dataset::import::take::TakeLimits;
use orator_dataset::import::write::{ImportOutcome, ImportPlan, rate_of};
use orator_dataset::import::{Imported, import};
use orator_dataset::info::About;
use orator_dataset::{INFO, Split, config};
use orator_formats::mocap::captured::MotionKind as Found;
use orator_formats::mocap::facing::LengthUnit;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Create a dataset from motion capture and its audio.
///
/// Each SOURCE is a file, or a folder that is searched for: text clips of Rebol et al. (2021) with 147 numbers per
/// line, TED Expressive (.npz with `human_joints`), SMPL-X and SMPL-H (.npz of BEAT2, EMAGE or AMASS, tar files of Seamless
/// Interaction), BVH, and WebDataset shards or dataset folders of this program, to merge or re-import them. Audio
/// (.wav, .flac, ...) and transcript (.tsv, .json, .TextGrid, .srt, .vtt, .txt) have the file name of the motion and
/// are in its folder or in neighbouring folders (bvh/, wav/, tsv/). Folders of the GENEA challenges of 2020, 2022 and
/// 2023 keep their splits, speaker IDs and the audio of interlocutors.
///
/// Each take is accepted, rejected with a reason, or failed. Exit code 2: a take failed.
#[derive(clap::Args)]
pub struct Args {
    /// Files or folders to import.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Import only files of this kind; `auto` detects it from the content.
    #[arg(long, value_enum, default_value_t = ImportKind::Auto)]
    kind: ImportKind,
    /// Speaker name in the dataset: letters, digits, - and _; defaults to the name of the folder --out.
    #[arg(long, value_name = "NAME")]
    speaker: Option<String>,
    /// Import only the takes of this speaker in the `metadata.csv` of a GENEA challenge.
    #[arg(long, value_name = "ID")]
    speaker_id: Option<u32>,
    /// Folder of the new dataset; must be empty unless --force is given.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace an existing dataset in the folder.
    #[arg(long)]
    force: bool,
    /// Frame rate of the dataset, frames per second; defaults to that of the first dataset among the sources, else to
    /// 15.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240))]
    fps: Option<FrameRate>,
    /// Minimum length of a take, in frames of the dataset.
    #[arg(long, default_value_t = 64, value_name = "N")]
    min_frames: usize,
    /// Maximum difference in duration between audio and motion, seconds.
    #[arg(long, default_value_t = 0.5, value_name = "SECS")]
    max_length_difference: f64,
    /// Unit of length of BVH files; detected from the length of the arms by default.
    #[arg(long, value_name = "m|cm|mm|inch")]
    units: Option<LengthUnit>,
    /// Import captures without audio: audio files are ignored and silence is stored instead. Such a dataset is for
    /// lifters and evaluation.
    #[arg(long, conflicts_with = "max_length_difference")]
    no_audio: bool,
    /// Fraction of the takes for validation, 0 to 0.9; takes are assigned by a hash of their content.
    #[arg(long, default_value_t = 0.15, value_name = "FRACTION")]
    validation: f64,
    /// Fraction of the takes for test, 0 to 0.9; takes are assigned by a hash of their content.
    #[arg(long, default_value_t = 0.15, value_name = "FRACTION")]
    test: f64,
    /// Licence identifier, for the dataset card.
    #[arg(long, default_value = "", value_name = "ID")]
    licence: String,
    /// Consent of the speaker, for the dataset card.
    #[arg(long, default_value = "", value_name = "TEXT")]
    consent: String,
    /// Origin of the motion, for the dataset card.
    #[arg(long, default_value = "", value_name = "TEXT")]
    source: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ImportKind {
    Auto,
    Authors,
    Ted,
    Bvh,
    Smplx,
    Shards,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    enter_sandbox([args.out.as_path()], args.sources.iter().chain([&args.out]).map(PathBuf::as_path));
    let plan = plan(&args)?;
    let out = std::path::absolute(&args.out)?;
    let _lock = FolderLock::exclusive(&out)?;
    let is_occupied = workdir::has_files(&out);
    ensure!(
        !is_occupied || args.force,
        "{} is not empty; choose another folder, or replace the dataset with --force",
        out.display()
    );
    ensure!(
        !is_occupied || out.join(INFO).is_file(),
        "{} is not a dataset, so --force does not replace it",
        out.display()
    );
    for source in &args.sources {
        let inside = out.exists() && out.starts_with(std::path::absolute(source)?);
        ensure!(!inside, "--out {} is inside the source {}; choose another folder", out.display(), source.display());
    }
    let datasets = args.sources.iter().filter(|source| source.join(INFO).is_file());
    let _sources = datasets.map(|dataset| FolderLock::shared(dataset)).collect::<Result<Vec<_>>>()?;
    let imported = workdir::build_folder(&out, |attempt| import(&plan, attempt, ui))?;
    close(&imported, &args.out, ui)
}

fn plan(args: &Args) -> Result<ImportPlan> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let folder = args.out.file_name().unwrap_or_default().to_string_lossy();
    let name = args.speaker.as_deref().unwrap_or(&folder);
    ensure!(!name.is_empty() && name.chars().all(plain), "--speaker {name:?}: expected letters, digits, - and _");
    let share = 0.0..=0.9;
    ensure!(
        share.contains(&args.validation) && share.contains(&args.test) && args.validation + args.test <= 0.95,
        "--validation and --test: expected 0 to 0.9, together at most 0.95"
    );
    ensure!((0.0..=60.0).contains(&args.max_length_difference), "--max-length-difference: expected 0 to 60 seconds");
    let fps = args.fps.or_else(|| rate_of(&args.sources)).unwrap_or(FrameRate::new(15, 1));
    let (licence, consent, source) = (args.licence.clone(), args.consent.clone(), args.source.clone());
    Ok(ImportPlan {
        sources: args.sources.clone(),
        speaker_id: args.speaker_id,
        kind: match args.kind {
            ImportKind::Auto => None,
            ImportKind::Authors => Some(Found::Authors),
            ImportKind::Ted => Some(Found::Ted),
            ImportKind::Bvh => Some(Found::Bvh),
            ImportKind::Smplx => Some(Found::Smplx),
            ImportKind::Shards => Some(Found::Shards),
        },
        about: About { licence, consent, source, ..About::new(name, fps) },
        limits: TakeLimits {
            fps,
            min_frames: args.min_frames.max(1),
            max_difference_secs: args.max_length_difference,
            no_sound: args.no_audio,
            units: args.units,
        },
        dataset: config::DatasetConfig {
            validation: args.validation,
            test: args.test,
            ..config::DatasetConfig::default()
        },
    })
}

fn close(imported: &Imported, out: &Path, ui: &Ui) -> Result<Outcome> {
    let count = |outcome: &str| imported.lines.iter().filter(|line| line.outcome == outcome).count();
    let mut lines: Vec<String> = imported.lines.iter().filter(|line| !line.message.is_empty()).map(text).collect();
    lines.extend(imported.notes.iter().cloned());
    let secs: BTreeMap<&str, f64> =
        imported.info.splits.iter().map(|(split, info)| (split.as_str(), info.secs)).collect();
    let parts =
        Split::ALL.map(|split| format!("{} {}", split.name(), length(secs.get(split.name()).copied().unwrap_or(0.0))));
    let (n_imported, rejected, failed) = (count("kept"), count("refused"), count("failed"));
    lines.push(format!(
        "{} imported, {rejected} rejected, {failed} failed; {}",
        counted(n_imported, "take"),
        parts.join(", ")
    ));
    lines.push(format!("dataset  {}", out.display()));
    let next = if imported.info.no_sound { verify_deep(out) } else { train_gan(out) };
    let facts = json!({
        "dataset": out, "takes": imported.lines, "notes": imported.notes, "secs": secs,
        "imported": n_imported, "rejected": rejected, "failed": failed, "next": next,
    });
    ui.summary(&lines.join("\n"), Some(&next), facts);
    Ok(if failed > 0 { Outcome::SomeFailed } else { Outcome::Done })
}

/// The command that checks every byte of a dataset.
pub fn verify_deep(dataset: &Path) -> String {
    format!("orator dataset verify --deep {}", dataset.display())
}

/// The command that trains on a dataset in any folder.
pub fn train_gan(dataset: &Path) -> String {
    let work = dataset.parent().filter(|folder| folder.ends_with("dataset")).and_then(Path::parent);
    let of_run = work.zip(dataset.file_name()).map(|(work, speaker)| work.join("gan").join(speaker));
    let beside = || PathBuf::from(format!("{}-gan", dataset.display()));
    format!("orator train gan --dataset {} --out {}", dataset.display(), of_run.unwrap_or_else(beside).display())
}

fn text(line: &ImportOutcome) -> String {
    let ImportOutcome { file, outcome, reason, message, .. } = line;
    match *outcome {
        "kept" => format!("imported  {file}: {message}"),
        "failed" => format!("failed    {file}: {message}"),
        _ => format!("rejected  {file}: {reason}: {message}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_model_is_proposed_among_the_datasets() {
        let out = |dataset: &str| train_gan(Path::new(dataset)).rsplit(' ').next().map(str::to_owned);
        assert_eq!(out("work/dataset/host"), Some("work/gan/host".to_owned()));
        assert_eq!(out("dataset/host"), Some("gan/host".to_owned()));
        assert_eq!(out("speech"), Some("speech-gan".to_owned()));
    }
}
