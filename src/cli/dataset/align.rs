//! `orator align`.

use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::text::{counted, length};
use orator_dataset::align::{Alignment, align};
use orator_formats::transcript::Transcript;
use orator_media::aligner::Aligner;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Maximum number of unaligned words that the summary lists.
const SHOWN: usize = 8;

/// Find the word times of an English transcript by forced alignment.
///
/// The transcript has sentence times only (.srt, .vtt, ...) or none (.txt). Given times limit the search for a word
/// to 5 s around them. Only English is supported: the acoustic model and the dictionary are those for US English in
/// the Python package pocketsphinx; `orator doctor` prints how to install it.
///
/// A word that does not match the audio (not spoken, pronounced differently, in another language) keeps its position
/// in the text and is marked: `source` is `interpolated`, `confidence` is 0. A transcript is rejected if less than a
/// quarter of its words match.
#[derive(clap::Args)]
pub struct Args {
    /// Audio file: wav, flac, mp3, or a video.
    #[arg(value_name = "AUDIO")]
    sound: PathBuf,
    /// Transcript file, in a format listed in `orator guide dataset`.
    #[arg(value_name = "TRANSCRIPT")]
    transcript: PathBuf,
    /// File of timed words to write; `orator run` finds it if it has the file name of the video.
    #[arg(long, value_name = "FILE.words.json")]
    out: PathBuf,
    /// Python interpreter with pocketsphinx; defaults to $ORATOR_PYTHON, else python3.
    #[arg(long, value_name = "PROGRAM")]
    python: Option<PathBuf>,
}

/// The Python interpreter used for alignment if the command line names none.
pub fn default_python() -> PathBuf {
    let named = std::env::var_os("ORATOR_PYTHON").filter(|name| !name.is_empty());
    named.map_or_else(|| "python3".into(), PathBuf::from)
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let is_json = args.out.extension().is_some_and(|ending| ending == "json");
    ensure!(is_json, "--out {}: expected a file that ends in .words.json", args.out.display());
    let is_same =
        |path: &Path| path.canonicalize().is_ok_and(|path| args.out.canonicalize().is_ok_and(|out| out == path));
    ensure!(
        !is_same(&args.transcript) && !is_same(&args.sound),
        "--out {} is an input; choose another file",
        args.out.display()
    );
    let aligner = Aligner::start(&args.python.unwrap_or_else(default_python))?;
    enter_sandbox([args.out.as_path()], []);
    let transcript = Transcript::read(&args.transcript)?;
    if !transcript.words.is_empty() {
        transcript.notes.iter().for_each(|note| ui.say(&format!("{}: {note}", args.transcript.display())));
    }
    let pair = || format!("cannot align {} with {}", args.transcript.display(), args.sound.display());
    let task = ui.begin("seconds of audio", 0);
    let mut secs = 0.0;
    let aligned = align(aligner, &args.sound, &transcript, |aligned_secs| {
        let before = secs as u64;
        secs += aligned_secs;
        task.advance(secs as u64 - before);
    });
    drop(task);
    let aligned = aligned.with_context(pair)?;
    let mut text = serde_json::to_string_pretty(&aligned.words)?;
    text.push('\n');
    workdir::write_file(&args.out, text.as_bytes())?;
    let Alignment { words, unaligned, sound_secs } = &aligned;
    let n_aligned = words.len() - words.iter().filter(|word| word.confidence == Some(0.0)).count();
    let mut lines =
        vec![format!("{n_aligned} of {} aligned in {} of audio", counted(words.len(), "word"), length(*sound_secs))];
    if !unaligned.is_empty() {
        let shown = unaligned
            .iter()
            .take(SHOWN)
            .map(|&n| format!("word {} `{}` near {:.1} s", n + 1, words[n].word, words[n].start_secs));
        let more = if unaligned.len() > SHOWN { ", ..." } else { "" };
        let shown = shown.collect::<Vec<_>>().join(", ");
        lines.push(format!("{} not aligned, with confidence 0: {shown}{more}", counted(unaligned.len(), "word")));
    }
    lines.push(format!("wrote {}", args.out.display()));
    let next = format!("orator words check {}", args.out.display());
    let marked = unaligned.iter().map(|&n| {
        json!({ "number": n + 1, "word": words[n].word, "start_secs": words[n].start_secs, "end_secs": words[n].end_secs })
    });
    let facts = json!({
        "out": args.out,
        "words": words.len(),
        "aligned": n_aligned,
        "unaligned": marked.collect::<Vec<_>>(),
        "sound_secs": sound_secs,
        "next": next,
    });
    ui.summary(&lines.join("\n"), Some(&next), facts);
    Ok(Outcome::Done)
}
