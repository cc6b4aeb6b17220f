//! `orator align`.

use super::aligned_text::{self, AlignedText, Unaligned, listed};
use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::{Progress, Task};
use orator_base::stage::workdir;
use orator_base::text::{counted, length};
use orator_base::types::sound::SAMPLE_RATE;
use orator_formats::transcript::Word;
use orator_media::aligner::{Aligner, SpokenWord};
use orator_media::ffmpeg::sound_stream::SoundStream;
use orator_media::ffmpeg::{UnreadableMedia, origin};
use serde_json::json;
use std::path::{Path, PathBuf};

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
    let given = AlignedText::read(&args.transcript, ui)?;
    let task = ui.begin("seconds of audio", 0);
    let aligned = align(aligner, &args.sound, &given, &*task);
    drop(task);
    let pair = || format!("cannot align {} with {}", args.transcript.display(), args.sound.display());
    let (words, unaligned, sound_secs) = aligned.with_context(pair)?;
    let mut text = serde_json::to_string_pretty(&words)?;
    text.push('\n');
    workdir::write_file(&args.out, text.as_bytes())?;
    let n_aligned = words.len() - words.iter().filter(|word| word.confidence == Some(0.0)).count();
    let mut lines =
        vec![format!("{n_aligned} of {} aligned in {} of audio", counted(words.len(), "word"), length(sound_secs))];
    if !unaligned.is_empty() {
        lines.push(format!(
            "{} not aligned, with confidence 0: {}",
            counted(unaligned.len(), "word"),
            listed(&unaligned)
        ));
    }
    lines.push(format!("wrote {}", args.out.display()));
    let next = format!("orator words check {}", args.out.display());
    let facts = json!({
        "out": args.out,
        "words": words.len(),
        "aligned": n_aligned,
        "unaligned": aligned_text::facts(&unaligned),
        "sound_secs": sound_secs,
        "next": next,
    });
    ui.summary(&lines.join("\n"), Some(&next), facts);
    Ok(Outcome::Done)
}

/// The words with times, those that could not be aligned, and the length of the audio in seconds.
fn align(aligner: Aligner, sound: &Path, given: &AlignedText, task: &dyn Task) -> Result<(Vec<Word>, Unaligned, f64)> {
    let zero_secs = origin::start_secs(sound)?;
    let within = given.within(zero_secs);
    let spoken = given.words().iter().enumerate();
    let spoken: Vec<SpokenWord> =
        spoken.map(|(n, word)| SpokenWord { word: word.clone(), within: within.get(n).copied().flatten() }).collect();
    let mut n_samples = 0;
    let found = aligner.align(&spoken, |take| {
        for piece in SoundStream::open(sound, SAMPLE_RATE) {
            let piece = piece?;
            let before = n_samples / SAMPLE_RATE as usize;
            n_samples += piece.len();
            task.advance((n_samples / SAMPLE_RATE as usize - before) as u64);
            take(&piece)?;
        }
        match n_samples {
            0 => Err(UnreadableMedia(format!("{} has no audio", sound.display())).into()),
            _ => Ok(()),
        }
    })?;
    let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
    let expected = "the English transcript of audible speech";
    let (words, unaligned) = given.with_times(&found, [zero_secs, secs], |share| share >= 0.25, expected)?;
    Ok((words, unaligned, secs))
}
