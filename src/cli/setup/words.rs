//! `orator words`: fetches word vectors or imports them from a file, and checks their coverage of transcripts.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::stage::workdir;
use orator_base::text::{counted, percent};
use orator_dataset::config::{self, Settings};
use orator_formats::transcript::Transcript;
use orator_formats::word_vectors::{WordVectors, glove, wink};
use orator_onnx::{ModelStore, sha256_of};
use serde_json::{Value, json};
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Folder of the tables within the models folder.
const FOLDER: &str = "words";
/// Name of the fetched table.
const GLOVE: &str = "glove-6b-100d";

/// Fetch, add and check word vectors.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: WordsVerb,
    /// Model folder, instead of `models.dir` of the configuration; the vectors are in its subfolder `words`.
    #[arg(long, global = true, value_name = "DIR")]
    models_dir: Option<PathBuf>,
    /// Configuration file; the defaults apply if it does not exist.
    #[arg(short, long, global = true, default_value = "pipeline.toml", value_name = "FILE")]
    config: PathBuf,
}

#[derive(clap::Subcommand)]
enum WordsVerb {
    /// Download GloVe vectors of 341,479 English words through the installed npm.
    ///
    /// 100 dimensions, 137 MB, licence PDDL.
    Fetch {
        /// Folder that is searched first for the package or its JSON, under any file name.
        #[arg(long, value_name = "DIR")]
        mirror: Option<PathBuf>,
    },
    /// Import a table of word vectors from a GloVe or word2vec text file.
    Add {
        /// Text file with a word and its vector per line, or the JSON of a wink-embeddings package.
        file: PathBuf,
        /// Name of the table; defaults to the file name.
        #[arg(long, value_name = "NAME")]
        name: Option<String>,
    },
    /// List the tables, and the share of words of the transcripts that each contains.
    ///
    /// Exit code 1: a table contains no word of one of the transcripts.
    Check {
        /// Transcript files, in the formats listed in `orator guide dataset`.
        #[arg(value_name = "TRANSCRIPT")]
        transcripts: Vec<PathBuf>,
    },
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let models = match &args.models_dir {
        Some(dir) => dir.clone(),
        None if args.config.exists() => config::load(&args.config, &[])?.settings.models.dir.clone(),
        None => Settings::default().models.dir.clone(),
    };
    let folder = models.join(FOLDER);
    match &args.verb {
        WordsVerb::Fetch { mirror } => {
            let table = path_of(&folder, GLOVE);
            let store = ModelStore::open(&models)?;
            if let Ok(existing) = WordVectors::open(&table) {
                let _ = store.sweep();
                return Ok(report_table(&table, &existing, "already installed", ui));
            }
            let terms = store.manifest().words.as_ref().map(|words| words.licence.clone()).unwrap_or_default();
            std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
            let source = store.fetch_words(mirror.as_deref(), ui, |json, from| {
                // The table is written last: if it exists, its licence file does too.
                workdir::write_file(&table.with_extension("licence.txt"), format!("{terms}\n").as_bytes())?;
                make(json, &table)?;
                Ok(from.to_string())
            })?;
            Ok(report_table(&table, &WordVectors::open(&table)?, &source, ui))
        }
        WordsVerb::Add { file, name } => {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let name = name.clone().unwrap_or(stem);
            let is_plain = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
            let is_name = !name.is_empty() && !name.starts_with('.') && name.chars().all(is_plain);
            ensure!(
                is_name,
                "invalid table name {name:?}: expected letters, digits, `.`, `-` and `_`; set one with --name"
            );
            std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
            let table = path_of(&folder, &name);
            make(file, &table)?;
            Ok(report_table(&table, &WordVectors::open(&table)?, &format!("created from {}", file.display()), ui))
        }
        WordsVerb::Check { transcripts } => check(&folder, transcripts, ui),
    }
}

fn path_of(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.safetensors"))
}

/// Converts a file of vectors into a table.
fn make(file: &Path, table: &Path) -> Result<()> {
    let reader = input::open(file).with_context(|| format!("cannot read {}", file.display()))?;
    let reader = BufReader::with_capacity(1 << 20, reader);
    let is_json = file.extension().is_some_and(|ending| ending == "json");
    let converted = workdir::replace(table, |attempt| {
        let n_words = if is_json { wink::convert(reader, attempt) } else { glove::convert(reader, attempt) };
        n_words.map(drop)
    });
    converted.with_context(|| format!("cannot read word vectors from {}", file.display()))
}

fn report_table(path: &Path, table: &WordVectors, how: &str, ui: &Ui) -> Outcome {
    let text = format!("{}: {} words, {} dimensions, {how}", path.display(), table.n_words(), table.dim());
    let hash = sha256_of(path).unwrap_or_default();
    let facts = json!({ "file": path, "words": table.n_words(), "dim": table.dim(), "sha256": hash });
    let next = format!("orator train seq2seq --words {}", path.display());
    ui.summary(&text, Some(&next), facts);
    Outcome::Done
}

/// Tables in a folder, sorted by name.
fn tables(folder: &Path) -> Vec<PathBuf> {
    let mut tables: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    tables.retain(|path| path.extension().is_some_and(|ending| ending == "safetensors"));
    tables.sort();
    tables
}

/// Tables in the models folder.
pub fn table_files(models: &Path) -> Vec<PathBuf> {
    tables(&models.join(FOLDER))
}

/// Tables in the models folder, each opened.
pub(super) fn opened(models: &Path) -> Vec<(PathBuf, Result<WordVectors>)> {
    table_files(models).into_iter().map(|path| (path.clone(), WordVectors::open(&path))).collect()
}

fn check(folder: &Path, transcripts: &[PathBuf], ui: &Ui) -> Result<Outcome> {
    let tables = tables(folder);
    ensure!(!tables.is_empty(), "no word vectors in {}: download them with `orator words fetch`", folder.display());
    let texts = transcripts.iter().map(|path| Ok((path, Transcript::read(path)?))).collect::<Result<Vec<_>>>()?;
    let (mut lines, mut facts, mut is_unknown) = (Vec::new(), Vec::<Value>::new(), false);
    for path in &tables {
        let table = WordVectors::open(path)?;
        lines.push(format!("{}: {} words, {} dimensions", path.display(), table.n_words(), table.dim()));
        let mut known = Vec::new();
        for (file, transcript) in &texts {
            let words: Vec<&str> = transcript.text.split_whitespace().collect();
            let (n_words, n_known) = (words.len(), table.n_known(words));
            let coverage = match (n_words, n_known) {
                (0, _) => "the transcript has no words".to_owned(),
                (_, 0) => format!("0 of {} in the table: check the language of the vectors", counted(n_words, "word")),
                _ => {
                    let share = percent(n_known as f64, n_words as f64);
                    format!("{n_known} of {} in the table ({share})", counted(n_words, "word"))
                }
            };
            is_unknown |= n_known == 0;
            lines.push(format!("  {}: {coverage}", file.display()));
            known.push(json!({ "file": file, "words": n_words, "known": n_known, "message": coverage }));
        }
        facts.push(json!({ "file": path, "words": table.n_words(), "dim": table.dim(), "transcripts": known }));
    }
    ui.summary(&lines.join("\n"), None, json!({ "tables": facts }));
    Ok(if is_unknown { Outcome::CheckFailed } else { Outcome::Done })
}
