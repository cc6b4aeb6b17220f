//! `orator generate`: one audio file (here), or a folder or table of them (`batch`).

use super::{batch, export};
use crate::cli::Outcome;
use crate::cli::config_args::DeviceArgs;
use crate::cli::figure_args::FigureArgs;
use crate::cli::outputs::{OutputFiles, is_same_file, names, next_output, outputs, variant_path};
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Context as _, Result, bail, ensure};
use orator_base::stage::progress::Progress as _;
use orator_base::text::{counted, length};
use orator_base::types::device::DeviceChoice;
use orator_formats::word_vectors::WordVectors;
use orator_gesture::batch::speech::{SegmentFacts, SpeechSource};
use orator_gesture::batch::{SpeechBatch, motion_files, sounds, transcripts};
use orator_gesture::generate::model::GenerationChoice;
use orator_gesture::generate::model::{checkpoint_file, model_lock};
use orator_gesture::generate::seq2seq::metadata::{cpu_only, reads_transcript};
use orator_gesture::generate::trained::TrainedSpeaker;
use orator_nn::seq2seq::predict::StateAtSeams;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

/// Generate motion from speech with a trained model.
///
/// The audio is a wav, flac or mp3 file or a video, of any length. The extension of each output selects its format:
/// .npy (joints [frames, 49, 3], metres), .txt (layout of Rebol et al. 2021), .bvh (bone rotations; cm, y up, facing
/// +z), .smplx.npz (SMPL-X rotations as in BEAT2), .fbx and .glb (skinned avatar with the motion), .vrm (avatar only),
/// .vrma (motion for VRM avatars), .json (joints and rotations), .mp4 (video of the avatar with the audio).
///
/// To process many files, give --out-folder and --format with --audio-folder (all audio files in a folder and its
/// subfolders) or --batch (a CSV table with the column `audio` and optionally `out`, `checkpoint` and `transcript`;
/// paths are relative to the table). Outputs of the same audio, transcript and checkpoint are not regenerated. A
/// failed file does not stop the others. Exit code 2: a file failed.
#[derive(clap::Args)]
pub struct Args {
    /// Checkpoint of `orator train gan` or `orator train seq2seq`, or its folder (the best checkpoint is used, else
    /// the newest).
    #[arg(long, value_name = "FILE|DIR", required_unless_present = "batch")]
    checkpoint: Option<PathBuf>,
    /// Audio file with the speech.
    #[arg(long, value_name = "FILE", required_unless_present_any = WITHOUT_AUDIO, requires = "out")]
    audio: Option<PathBuf>,
    /// Timed transcript for a model that uses words (.tsv, .json, .TextGrid, .ctm, .srt, .vtt); for many audio files,
    /// a folder of transcripts with the same file names. Defaults to the files next to the audio when many files are
    /// processed.
    #[arg(long, value_name = "FILE|DIR")]
    transcript: Option<PathBuf>,
    /// Table of word vectors for words of the transcript that did not occur in training.
    #[arg(long, value_name = "FILE")]
    words: Option<PathBuf>,
    /// Speaker, for a model of several speakers.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["audio_folder", "batch"])]
    speaker: Option<String>,
    /// Keep the decoder state of a sequence-to-sequence network across segments.
    #[arg(long)]
    carry_state: bool,
    /// Seed of a variant of the motion: different seeds give different motion, equal seeds give equal motion.
    #[arg(long, value_name = "N", conflicts_with_all = ["audio_folder", "batch"])]
    seed: Option<u64>,
    /// Number of variants, with consecutive seeds from --seed (or 1): `motion.bvh` becomes `motion-1.bvh`,
    /// `motion-2.bvh`, ...
    #[arg(long, value_name = "K", requires = "audio", value_parser = clap::value_parser!(u64).range(1..=1000))]
    variants: Option<u64>,
    /// File to write; may be repeated.
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "audio")]
    out: Vec<PathBuf>,
    #[command(flatten)]
    figure: FigureArgs,
    /// Folder that is searched recursively for audio files.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["audio", "batch"], requires = "out_folder")]
    audio_folder: Option<PathBuf>,
    /// CSV table of audio files.
    #[arg(long, value_name = "FILE", conflicts_with = "audio", requires = "out_folder")]
    batch: Option<PathBuf>,
    /// Output folder for --audio-folder and --batch.
    #[arg(long, value_name = "DIR", conflicts_with = "audio")]
    out_folder: Option<PathBuf>,
    /// Formats to write for --audio-folder and --batch: file extensions, separated by commas.
    #[arg(long, value_name = "EXTENSION", value_delimiter = ',', default_value = "bvh", conflicts_with = "audio")]
    format: Vec<String>,
    /// Regenerate outputs of --audio-folder and --batch that are up to date.
    #[arg(long, conflicts_with = "audio")]
    force: bool,
    /// Instead of generating, write the trained network as ONNX for other programs and browsers, and its front end
    /// from audio samples beside it: `model.onnx` and `model.mel.onnx`. `orator guide onnx` shows how to run them.
    #[arg(long, value_name = "FILE", requires = "checkpoint", conflicts_with_all = EXCLUDED_BY_EXPORT)]
    export: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Arguments that replace --audio.
const WITHOUT_AUDIO: [&str; 3] = ["audio_folder", "batch", "export"];
/// Arguments that are about a sound or its motion.
const EXCLUDED_BY_EXPORT: [&str; 9] =
    ["audio", "audio_folder", "batch", "transcript", "words", "out", "out_folder", "force", "variants"];

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let device = args.device;
    if let (Some(out), Some(checkpoint)) = (&args.export, &args.checkpoint) {
        let choice = GenerationChoice { speaker: args.speaker, seed: args.seed };
        return export::run(checkpoint, &choice, out, args.carry_state, ui);
    }
    let Some(audio) = &args.audio else { return batch::run(&batch(args)?, device, ui) };
    let variants = variants(&args);
    let files: Vec<Vec<PathBuf>> = variants.iter().map(|variant| variant.files(&args.out)).collect();
    let device = device.open(DeviceChoice::Cpu, || cpu_only(args.checkpoint.as_deref()), ui)?;
    if device.is_cpu() {
        enter_sandbox(files.iter().flatten().map(PathBuf::as_path), args.checkpoint.as_deref());
    }
    let Some(given) = &args.checkpoint else { bail!("give --checkpoint") };
    let outputs: Vec<OutputFiles> = files
        .iter()
        .map(|files| outputs(files, |path| is_same_file(path, audio), "the audio input", ""))
        .collect::<Result<_>>()?;
    outputs.iter().try_for_each(|outputs| args.figure.check(outputs))?;
    let checkpoint = checkpoint_file(given)?;
    if checkpoint != *given {
        ui.say(&format!("checkpoint {}", checkpoint.display()));
    }
    let _lock = model_lock(&checkpoint)?;
    let vectors = args.words.as_deref().map(WordVectors::open).transpose()?.map(Arc::new);
    let (transcript, carry_state, figure) = (args.transcript.as_deref(), args.carry_state, args.figure.options());
    let source = SpeechSource { audio, transcript, carry_state, figure };
    let mut results = Vec::new();
    for (variant, outputs) in variants.iter().zip(&outputs) {
        let choice = GenerationChoice { speaker: args.speaker.clone(), seed: variant.seed };
        let mut trained = TrainedSpeaker::open_as(&checkpoint, &choice, &device)?;
        if let Some(vectors) = &vectors {
            trained.set_word_vectors(vectors.clone())?;
        }
        results.push((motion_files::write(&trained, &source, outputs, ui)?, trained));
    }
    let Some((written, trained)) = results.first() else { bail!("--variants: expected at least 1") };
    let speed =
        written.secs * results.len() as f64 / results.iter().map(|result| result.0.motion_secs).sum::<f64>().max(1e-6);
    let names: Vec<String> = outputs.iter().flat_map(names).collect();
    let note = written.note.as_ref().map_or(String::new(), |note| format!("note: {note}\n"));
    let n_variants = if results.len() > 1 { format!("{} variants of ", results.len()) } else { String::new() };
    let text = format!(
        "{n_variants}{} of speech, {} of {} at {}, {speed:.0} times real time\n{note}{}wrote {}",
        length(written.secs),
        counted(written.n_frames, "frame"),
        trained.name(),
        trained.fps(),
        written.segments.as_ref().map(segments).unwrap_or_default(),
        names.join(", ")
    );
    let flags = args.transcript.as_ref().map_or(String::new(), |path| format!(" --transcript {}", path.display()));
    let flags = args.words.as_ref().map_or(flags.clone(), |path| format!("{flags} --words {}", path.display()));
    let flags = args.speaker.as_ref().map_or(flags.clone(), |name| format!("{flags} --speaker {name}"));
    let carried = if args.carry_state { " --carry-state" } else { "" };
    let seed =
        variants.first().and_then(|variant| variant.seed).map_or(String::new(), |seed| format!(" --seed {seed}"));
    // Motion on a captured skeleton can be written as .bvh only.
    let next = outputs.first().and_then(|files| next_output(files, |path| is_same_file(path, audio)));
    let next = next.filter(|_| !trained.is_captured()).map(|out| {
        let (checkpoint, audio, out) = (given.display(), audio.display(), out.display());
        format!("orator generate --checkpoint {checkpoint} --audio {audio}{flags}{carried}{seed} --out {out}")
    });
    let seeds: Vec<Option<u64>> = variants.iter().map(|variant| variant.seed).collect();
    let facts = json!({
        "audio_secs": written.secs,
        "n_frames": written.n_frames,
        "fps": trained.fps(),
        "times_real_time": speed,
        "checkpoint": checkpoint,
        "speaker": trained.name(),
        "segments": written.segments,
        "seeds": seeds,
        "outputs": names,
        "note": written.note,
        "next": next,
    });
    ui.summary(&text, next.as_deref(), facts);
    Ok(Outcome::Done)
}

/// A variant of the motion for one speech.
struct Variant {
    /// Seed of the variant; `None` for the complete network.
    seed: Option<u64>,
    /// Number from 1 if there are several variants.
    number: Option<usize>,
}

impl Variant {
    /// Output files of this variant.
    fn files(&self, out: &[PathBuf]) -> Vec<PathBuf> {
        let file = |path: &PathBuf| self.number.map_or_else(|| path.clone(), |number| variant_path(path, number));
        out.iter().map(file).collect()
    }
}

/// The requested variants.
fn variants(args: &Args) -> Vec<Variant> {
    match (args.seed, args.variants) {
        (seed, None) => vec![Variant { seed, number: None }],
        (seed, Some(n)) => {
            let first = seed.unwrap_or(1);
            let variant = |i: u64| Variant { seed: Some(first.wrapping_add(i)), number: Some(i as usize + 1) };
            (0..n).map(variant).collect()
        }
    }
}

/// Lines about jumps at segment boundaries, and about the words of the transcript.
fn segments(facts: &SegmentFacts) -> String {
    let SegmentFacts { state, seam_jump: [raw, smoothed], other_seam_jump: [other_raw, other_smoothed], .. } = facts;
    let other = match state {
        StateAtSeams::Renewed => "with --carry-state",
        StateAtSeams::Carried => "with the state renewed",
    };
    let from_table = facts.words_from_table;
    let from_table = from_table.map_or(String::new(), |n| format!(", {n} of the others in the table of word vectors"));
    let known = facts.words.map_or(String::new(), |[n, n_known]| {
        let words = counted(n, "word");
        format!("{n_known} of {words} of the transcript are in the vocabulary of the model{from_table}\n")
    });
    format!(
        "{known}mean step at segment boundaries / elsewhere: {raw:.2} generated, {smoothed:.2} smoothed \
         ({other} {other_raw:.2}, {other_smoothed:.2})\n"
    )
}

/// The batch that the arguments describe.
fn batch(args: Args) -> Result<SpeechBatch> {
    let folder = args.out_folder.context("give --out-folder, the folder for the motions")?;
    let (mut sounds, passed_over) = match (&args.batch, &args.audio_folder) {
        (Some(table), _) => (sounds::of_table(table)?, Vec::new()),
        (None, Some(sounds)) => sounds::of_folder(sounds, &folder)?,
        (None, None) => bail!("give --audio, --audio-folder or --batch"),
    };
    if let (Some(_), Some(checkpoint)) = (&args.transcript, &args.checkpoint) {
        let is_used = reads_transcript(&checkpoint_file(checkpoint)?)?;
        ensure!(is_used, "{} does not use words; omit --transcript", checkpoint.display());
    }
    transcripts::find(&mut sounds, args.transcript.as_deref())?;
    let figure = args.figure.options();
    let Args { format: formats, checkpoint, words, carry_state, force: again, .. } = args;
    Ok(SpeechBatch { sounds, passed_over, folder, formats, checkpoint, words, carry_state, figure, again })
}
