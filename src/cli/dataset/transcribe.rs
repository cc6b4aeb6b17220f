//! `orator transcribe`: words with times from speech, or the times of the words of a given text (`aligned_text`).

use super::aligned_text::{self, AlignedText, Unaligned, listed};
use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::outputs::is_same_file;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::signals;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail, ensure};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::text::{counted, length, percent};
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::config::Settings;
use orator_formats::transcript::{SpokenSegment, TranscriptFormat, Word};
use orator_formats::wav::WavRanges;
use orator_media::aligner::AlignedWord;
use orator_media::ffmpeg::origin;
use orator_onnx::{AUTO, ModelStore};
use orator_pipeline::sound;
use orator_pipeline::speech::speech_rule::SpeechDetector;
use orator_pipeline::transcribe::{spoken, steps_of};
use orator_speech::{Recognised, RecognisedWord, Recogniser, RecogniserOptions};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Audio of a given text, for errors.
const EXPECTED: &str = "the transcript of audible speech, in the language of --language and of the model";

/// Write the words of audio or video files with their times.
///
/// The network, Whisper, runs on this computer: `orator models fetch whisper-tiny-en` (English) or `whisper-base` (99
/// languages) downloads it. The extension of --out selects the format: .json (segments and words as WhisperX writes
/// them), .srt, .vtt (also with word times) or .TextGrid (a tier of words).
///
/// With --text the words are given, and their times are found. A word that does not match the audio is marked in .json:
/// `source` is `interpolated`, `score` is 0. A text is rejected unless more than half of its words match.
///
/// Exit code 2: one of several files failed.
#[derive(clap::Args)]
pub struct Args {
    /// Audio files (wav, flac, mp3, ...) or videos.
    #[arg(value_name = "SOUND|VIDEO", required = true)]
    inputs: Vec<PathBuf>,
    /// File to write, or the folder for the transcripts of several files.
    #[arg(long, value_name = "FILE|DIR")]
    out: PathBuf,
    /// Format of the files in a folder: json, srt, vtt or TextGrid.
    #[arg(long, value_name = "EXTENSION", default_value = "json")]
    format: String,
    /// Code of the language, such as `de`; defaults to `transcribe.language`, else detected.
    #[arg(long, value_name = "CODE")]
    language: Option<String>,
    /// Model id, or folder with a Whisper network (CTranslate2 or safetensors); defaults to `transcribe.model`.
    #[arg(long, value_name = "ID|DIR")]
    model: Option<String>,
    /// Number of sequences that the search keeps; 1 is greedy, and faster.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=20))]
    beam: u8,
    /// Transcript without word times, in a format listed in `orator guide dataset`, to align with the audio.
    #[arg(long, value_name = "FILE", conflicts_with = "beam")]
    text: Option<PathBuf>,
    #[command(flatten)]
    config: ConfigArgs,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let outs = outs(&args)?;
    let settings = settings(&args)?;
    let folder = ModelStore::open(&settings.models.dir)?.recogniser(settings.transcribe.model_id());
    let is_any_language = settings.transcribe.language.is_empty() && settings.transcribe.model == AUTO;
    let folder = folder.with_context(|| match is_any_language {
        true => "no language is given; English needs only the model whisper-tiny-en (`--language en`)",
        false => "cannot use the model of --model or [transcribe]",
    })?;
    enter_sandbox(outs.iter().map(PathBuf::as_path), []);
    signals::exit_on_signal("transcripts that were reported as written are complete");
    let text = args.text.as_deref().map(|path| AlignedText::read(path, ui)).transpose()?;
    let recogniser = Recogniser::open(&folder);
    let recogniser = recogniser.with_context(|| format!("cannot use the speech recogniser {}", folder.display()))?;
    let transcriber = Transcriber { settings: &settings, recogniser, beam: args.beam.into(), text: text.as_ref(), ui };
    let mut results = Vec::new();
    for (input, out) in args.inputs.iter().zip(&outs) {
        let written = transcriber.write(input, out).with_context(|| format!("cannot transcribe {}", input.display()));
        if args.inputs.len() == 1 && written.is_err() {
            return written.map(|_| Outcome::SomeFailed);
        }
        if args.inputs.len() > 1 {
            ui.say(&line(out, &written));
        }
        results.push((input, out, written));
    }
    let mut lines: Vec<String> = results.iter().map(|(_, out, written)| line(out, written)).collect();
    let has_failed = results.iter().any(|(.., written)| written.is_err());
    lines.push(
        "`orator run` reads transcripts that have the names of the videos: list them in [[speaker]] transcripts".into(),
    );
    let written = results.iter().filter(|(.., written)| written.is_ok());
    let next: String = written.take(3).map(|(_, out, _)| format!(" {}", out.display())).collect();
    let next = Some(format!("orator words check{next}")).filter(|_| !next.is_empty());
    let facts: Vec<Value> = results.iter().map(|(input, out, written)| facts(input, out, written)).collect();
    ui.summary(&lines.join("\n"), next.as_deref(), json!({ "transcripts": facts, "next": next }));
    Ok(if has_failed { Outcome::SomeFailed } else { Outcome::Done })
}

/// Settings of `pipeline.toml` with the language and the model of the command line.
fn settings(args: &Args) -> Result<Settings> {
    let mut settings = args.config.load_or_default()?.settings;
    if let Some(language) = &args.language {
        settings.transcribe.language.clone_from(language);
    }
    if let Some(model) = &args.model {
        settings.transcribe.model.clone_from(model);
    }
    Ok(settings)
}

/// File to write for each input.
fn outs(args: &Args) -> Result<Vec<PathBuf>> {
    let Args { inputs, out, text, .. } = args;
    let in_folder = |input: &PathBuf| {
        let mut name = input.file_stem().unwrap_or_default().to_os_string();
        name.push(format!(".{}", args.format.trim_start_matches('.')));
        out.join(name)
    };
    let is_folder = inputs.len() > 1 || out.is_dir();
    ensure!(text.is_none() || inputs.len() == 1, "--text: expected one audio file, found {}", inputs.len());
    let outs: Vec<PathBuf> = if is_folder { inputs.iter().map(in_folder).collect() } else { vec![out.clone()] };
    for (n, path) in outs.iter().enumerate() {
        TranscriptFormat::from_path(path)?;
        let is_read = inputs.iter().chain(text).any(|input| is_same_file(input, path));
        ensure!(!is_read, "output {} is an input; choose another path", path.display());
        if let Some(other) = outs[..n].iter().position(|other| other == path) {
            let [a, b] = [other, n].map(|n| inputs[n].display());
            bail!("{a} and {b} would both be written to {}: transcribe them into two folders", path.display());
        }
    }
    Ok(outs)
}

/// A written transcript.
struct WrittenTranscript {
    n_words: usize,
    /// Words of a given text that do not match the audio, with their numbers from 1.
    unaligned: Unaligned,
    /// Code of the language, empty if unknown, and its probability.
    language: (String, f32),
    secs: f64,
    speech_secs: f64,
    times_real_time: f64,
}

/// Line of the summary for the transcript `out`.
fn line(out: &Path, written: &Result<WrittenTranscript>) -> String {
    let written = match written {
        Ok(written) => written,
        Err(error) => return format!("failed  {error:#}"),
    };
    let WrittenTranscript { n_words, unaligned, language: (code, probability), .. } = written;
    let (words, audio) = (counted(*n_words, "word"), length(written.secs));
    let mut line = match unaligned.len() {
        0 => format!("{words} in {audio} of audio"),
        n => format!("{} of {words} aligned in {audio} of audio", n_words - n),
    };
    if !code.is_empty() {
        line += &format!(", language {code} ({})", percent(f64::from(*probability), 1.0));
    }
    line += &format!(", {:.1} times real time: {}", written.times_real_time, out.display());
    if !unaligned.is_empty() {
        line += &format!("\n  not aligned: {}", listed(unaligned));
    }
    line
}

fn facts(input: &Path, out: &Path, written: &Result<WrittenTranscript>) -> Value {
    let written = match written {
        Ok(written) => written,
        Err(error) => return json!({ "input": input, "error": format!("{error:#}") }),
    };
    json!({
        "input": input,
        "out": out,
        "words": written.n_words,
        "unaligned": aligned_text::facts(&written.unaligned),
        "language": written.language.0,
        "language_probability": written.language.1,
        "secs": written.secs,
        "speech_secs": written.speech_secs,
        "times_real_time": written.times_real_time,
    })
}

struct Transcriber<'a> {
    settings: &'a Settings,
    recogniser: Recogniser,
    beam: usize,
    text: Option<&'a AlignedText>,
    ui: &'a Ui,
}

/// Audio of a file, at 16 kHz.
struct OpenedSound {
    ranges: WavRanges,
    /// Ranges with speech, seconds.
    speech: Vec<Range<f64>>,
    /// Start of the audio in the file, seconds.
    zero_secs: f64,
}

impl Transcriber<'_> {
    /// Decodes the audio of `input` into a temporary file beside `out`, which is removed before the function returns.
    fn open(&self, input: &Path, out: &Path) -> Result<OpenedSound> {
        let scratch = workdir::attempt_folder(&out.with_extension("audio"))?;
        let open = || -> Result<OpenedSound> {
            let path = scratch.join("sound.wav");
            sound::extract_wav(input, 0, &path, SAMPLE_RATE)?;
            ensure!(path.exists(), "{} has no audio", input.display());
            let speech = match SpeechDetector::find(self.settings)? {
                Some(detector) => detector.ranges(&path)?,
                None => sound::loud_ranges(&path)?,
            };
            let ranges = WavRanges::open(&path, SAMPLE_RATE)?;
            Ok(OpenedSound { ranges, speech, zero_secs: origin::start_secs(input)? })
        };
        let opened = open().map_err(workdir::full_disk);
        let removed = workdir::remove(&scratch).with_context(|| format!("cannot remove {}", scratch.display()));
        opened.and_then(|opened| removed.map(|()| opened))
    }

    /// Writes the transcript of `input` to `out`.
    fn write(&self, input: &Path, out: &Path) -> Result<WrittenTranscript> {
        let format = TranscriptFormat::from_path(out)?;
        let started = Instant::now();
        let OpenedSound { mut ranges, speech, zero_secs } = self.open(input, out)?;
        let n_samples = ranges.n_samples();
        let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
        let label = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let task = self.ui.begin(&label, secs.ceil() as u64);
        let mut progress = steps_of(task);
        let mut source = |range: Range<usize>| ranges.read(range);
        let language = Some(self.settings.transcribe.language.as_str()).filter(|code| !code.is_empty());
        let (segments, language, unaligned) = match self.text {
            None => {
                let options = RecogniserOptions { language: language.map(str::to_owned), beam: self.beam };
                let found = self.recogniser.recognise(&mut source, n_samples, &speech, &options, &mut progress)?;
                let Recognised { language, language_probability, segments } = found;
                (spoken(segments, zero_secs), (language, language_probability), Vec::new())
            }
            Some(text) => {
                let (words, within) = (text.words(), text.within(zero_secs));
                let found = self.recogniser.align(&mut source, n_samples, words, &within, language, &mut progress)?;
                let of_word = |RecognisedWord { start_secs, end_secs, probability, .. }| AlignedWord {
                    start_secs,
                    end_secs,
                    confidence: f64::from(probability),
                };
                let found: Vec<_> = found.into_iter().map(|word| word.map(of_word)).collect();
                let (words, unaligned) = text.with_times(&found, [zero_secs, secs], |share| share > 0.5, EXPECTED)?;
                (sentences(&words), (language.unwrap_or_default().to_owned(), 1.0), unaligned)
            }
        };
        drop(progress);
        let words: Vec<&Word> = segments.iter().flat_map(|segment| &segment.words).collect();
        workdir::write_file(out, format.write(&segments, &language.0, zero_secs + secs).as_bytes())?;
        Ok(WrittenTranscript {
            n_words: words.len(),
            unaligned,
            language,
            secs,
            speech_secs: speech.iter().map(|range| range.end - range.start).fold(0.0, |sum, secs| sum + secs),
            times_real_time: secs / started.elapsed().as_secs_f64().max(1e-6),
        })
    }
}

/// Divides words after the marks that end a sentence.
fn sentences(words: &[Word]) -> Vec<SpokenSegment> {
    let ends = |word: &Word| word.word.ends_with(['.', '?', '!', '\u{3002}']);
    let sentence = |words: &[Word]| SpokenSegment {
        start_secs: words.first().map_or(0.0, |word| word.start_secs),
        end_secs: words.last().map_or(0.0, |word| word.end_secs),
        text: words.iter().map(|word| word.word.as_str()).collect::<Vec<_>>().join(" "),
        words: words.to_vec(),
    };
    words.split_inclusive(ends).map(sentence).collect()
}
