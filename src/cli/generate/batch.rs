//! Many sounds to motions in one call. Each motion has a record (`.made/NAME.record.json` below the folder of outputs) of what it
//! was made from, written last, so that the same call again makes only what is missing or changed.

use super::made;
use super::table;
use super::table::Row;
use super::verb::{Args, checkpoint_at};
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context as _, Result, ensure};
use orator::animate::AnimationOptions;
use orator::animate::export::file::ExportFormat;
use orator::external::ffmpeg::probe;
use orator::generate::Speaker;
use orator::stage::artifacts;
use orator::stage::fingerprint::{Fingerprint, HashCache, hash_file};
use orator::stage::progress::{Progress as _, Silent};
use orator::stage::record::{Output, Record};
use orator::stage::{counted, workdir};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Goes up when the same sound and checkpoint give other bytes.
const VERSION: u32 = 1;
/// Records are in this folder below the outputs'.
const RECORDS: &str = ".made";
/// Rows of the closing table at most, failures not counted.
const MOST_ROWS: usize = 30;

/// How a row ended.
enum Ended {
    Made(Map<String, Value>),
    Skipped(Map<String, Value>),
    Failed(String),
}

/// Everything the rows share.
struct Batch<'a> {
    folder: &'a Path,
    formats: Vec<(String, ExportFormat)>,
    checkpoint: Option<PathBuf>,
    speakers: BTreeMap<PathBuf, Rc<Speaker>>,
    hashes: HashCache,
    again: bool,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let folder = args.out_folder.as_deref().context("give --out-folder, where the motions go")?;
    let formats = formats(&args.format)?;
    let rows = match (&args.batch, &args.audio_folder) {
        (Some(table), _) => table::of_file(table)?,
        (None, Some(sounds)) => table::of_folder(sounds, folder)?,
        (None, None) => anyhow::bail!("give --audio, --audio-folder or --batch"),
    };
    let checkpoint = args.checkpoint.as_deref().map(checkpoint_at).transpose()?;
    if checkpoint.is_none()
        && let Some(row) = rows.iter().find(|row| row.checkpoint.is_none())
    {
        anyhow::bail!("the table names no checkpoint for {}; give --checkpoint", row.audio.display());
    }
    let _lock = workdir::lock(&folder.join(RECORDS))?;
    let mut batch = Batch {
        folder,
        formats,
        checkpoint,
        speakers: BTreeMap::new(),
        hashes: HashCache::open(&artifacts::hashes(&folder.join(RECORDS))),
        again: args.again,
    };
    // a checkpoint that cannot be read is no matter of one row
    if let Some(path) = batch.checkpoint.clone() {
        batch.speaker(&path)?;
    }
    let secs: Vec<u64> = rows.iter().map(|row| stated_secs(&row.audio)).collect();
    let task = ui.begin("generate", secs.iter().sum());
    let mut ended = Vec::new();
    for (row, secs) in rows.iter().zip(secs) {
        task.detail(&row.name);
        let answer = batch.row(row).unwrap_or_else(|error| Ended::Failed(format!("{error:#}")));
        if let Ended::Failed(error) = &answer {
            ui.say(&format!("failed  {}: {error}", row.name));
        }
        ended.push(answer);
        task.advance(secs);
        batch.hashes.save_now_and_then();
    }
    drop(task);
    batch.hashes.save()?;
    Ok(summary(&rows, &ended, folder, ui))
}

/// Seconds as the file's head states them, for the bar.
fn stated_secs(path: &Path) -> u64 {
    let secs = probe::probe(path).ok().and_then(|info| info.duration_secs).unwrap_or(1.0);
    secs.clamp(1.0, 1e6) as u64
}

/// The formats by their endings.
fn formats(endings: &[String]) -> Result<Vec<(String, ExportFormat)>> {
    let mut formats: Vec<(String, ExportFormat)> = Vec::new();
    for ending in endings {
        let ending = ending.trim().trim_start_matches('.').to_lowercase();
        let format = ExportFormat::from_path(Path::new(&format!("motion.{ending}"))).context("--format")?;
        ensure!(formats.iter().all(|(known, _)| *known != ending), "--format names {ending} twice");
        formats.push((ending, format));
    }
    Ok(formats)
}

impl Batch<'_> {
    fn speaker(&mut self, path: &Path) -> Result<Rc<Speaker>> {
        if let Some(speaker) = self.speakers.get(path) {
            return Ok(speaker.clone());
        }
        let speaker = Rc::new(Speaker::open(path)?);
        self.speakers.insert(path.to_owned(), speaker.clone());
        Ok(speaker)
    }

    fn row(&mut self, row: &Row) -> Result<Ended> {
        let own = row.checkpoint.as_deref().map(checkpoint_at).transpose()?;
        let checkpoint = own.or_else(|| self.checkpoint.clone()).context("no checkpoint is named")?;
        let endings: Vec<&str> = self.formats.iter().map(|(ending, _)| ending.as_str()).collect();
        let now = Fingerprint {
            stage: "generate".to_owned(),
            version: VERSION,
            settings: json!({ "formats": endings, "animation": format!("{:?}", AnimationOptions::default()) }),
            inputs: BTreeMap::from([
                ("sound".to_owned(), self.hashes.hash(&row.audio)?),
                ("checkpoint".to_owned(), self.hashes.hash(&checkpoint)?),
            ]),
        };
        let place = self.folder.join(RECORDS).join(&row.name);
        if let (false, Some(record)) = (self.again, Record::read(&place))
            && record.dirty(&now, self.folder).is_none()
        {
            return Ok(Ended::Skipped(record.facts));
        }
        let speaker = self.speaker(&checkpoint)?;
        let file = |ending: &str| format!("{}.{ending}", row.name);
        let outputs: Vec<(PathBuf, ExportFormat)> =
            self.formats.iter().map(|(ending, format)| (self.folder.join(file(ending)), *format)).collect();
        let is_itself =
            |path: &PathBuf| path.canonicalize().is_ok_and(|p| row.audio.canonicalize().is_ok_and(|a| a == p));
        for (path, _) in &outputs {
            ensure!(!is_itself(path), "{} is the speech itself; choose another --out-folder", path.display());
        }
        // an old record must not speak for new files
        Record::forget(&place)?;
        let made = made::make(&speaker, &row.audio, &outputs, &Silent)?;
        let outputs = self.formats.iter().map(|(ending, _)| {
            let path = self.folder.join(file(ending));
            Ok(Output { file: file(ending), bytes: std::fs::metadata(&path)?.len(), hash: hash_file(&path)? })
        });
        let facts = json!({
            "secs": made.secs, "n_frames": made.n_frames, "speaker": speaker.name(), "note": made.note,
        });
        let facts = facts.as_object().cloned().unwrap_or_default();
        let outputs = outputs.collect::<Result<_>>()?;
        Record { fingerprint: now, outputs, line: String::new(), facts: facts.clone() }.write(&place)?;
        Ok(Ended::Made(facts))
    }
}

fn summary(rows: &[Row], ended: &[Ended], folder: &Path, ui: &Ui) -> Outcome {
    let count = |is: fn(&Ended) -> bool| ended.iter().filter(|ended| is(ended)).count();
    let made = count(|ended| matches!(ended, Ended::Made(_)));
    let skipped = count(|ended| matches!(ended, Ended::Skipped(_)));
    let failed = count(|ended| matches!(ended, Ended::Failed(_)));
    let width = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).clamp(4, 40);
    let mut text = String::new();
    let mut facts = Vec::new();
    let mut n_listed = 0;
    for (row, ended) in rows.iter().zip(ended) {
        let (word, of) = match ended {
            Ended::Made(of) => ("made", of),
            Ended::Skipped(of) => ("fresh", of),
            Ended::Failed(error) => {
                text += &format!("{:width$}  failed  {error}\n", row.name);
                facts.push(json!({ "audio": row.audio, "out": row.name, "ended": "failed", "error": error }));
                continue;
            }
        };
        let mut fact = json!({ "audio": row.audio, "out": row.name, "ended": word });
        of.iter().for_each(|(key, value)| fact[key] = value.clone());
        n_listed += 1;
        if n_listed <= MOST_ROWS {
            let note = fact["note"].as_str().map_or(String::new(), |note| format!("  note: {note}"));
            text += &format!(
                "{:width$}  {word:6}  {:8.1} s {:7} frames  {}{note}\n",
                row.name,
                fact["secs"].as_f64().unwrap_or(0.0),
                fact["n_frames"],
                fact["speaker"].as_str().unwrap_or_default(),
            );
        }
        facts.push(fact);
    }
    if n_listed > MOST_ROWS {
        text += &format!("and {} more\n", n_listed - MOST_ROWS);
    }
    text += &format!(
        "{}: {made} made, {skipped} fresh, {failed} failed; in {}",
        counted(rows.len(), "sound"),
        folder.display()
    );
    let facts = json!({ "made": made, "fresh": skipped, "failed": failed, "out_folder": folder, "sounds": facts });
    ui.summary(&text, None, facts);
    if failed > 0 { Outcome::SomeFailed } else { Outcome::Done }
}
