//! `orator generate`: one sound to files (here), or a folder or table of sounds (`batch`).

use super::batch;
use crate::cli::Outcome;
use crate::cli::confine::confine;
use crate::cli::outputs::{is_same_file, names, next_output, outputs};
use crate::cli::ui::Ui;
use anyhow::{Context as _, Result, bail, ensure};
use orator::generate::GestureGenerator;
use orator::generate::seq2seq::SequenceGenerator;
use orator::generate::seq2seq::metadata::is_sequence;
use orator::pipeline::batch::motion_files::{checkpoint_file, model_lock, write_motion};
use orator::pipeline::batch::sequence_files::write_sequence;
use orator::pipeline::batch::{SpeechBatch, sounds};
use orator::stage::progress::Progress as _;
use serde_json::json;
use std::path::PathBuf;

/// Turn speech into motion with a trained speaker.
///
/// The sound may be a wav, flac or mp3 file or the sound of a video, of any length. The ending of each output file
/// chooses what is written: .npy (joints [frames, 49, 3], metres), .txt (the layout of Rebol et al. 2021), .bvh (bone
/// rotations, cm, y up, facing +z), .glb (a skinned avatar with the motion), .json (joints and rotations), .mp4 (a film
/// of the figure with the sound).
///
/// Many sounds at once: --audio-folder (everything that sounds below it) or --batch (a table, columns `audio`, `out` and
/// `checkpoint`, of which the first is needed and paths count from the table's folder), with --out-folder and --format. What
/// is there already from the same sound and checkpoint is not made again; a sound that fails does not stop the others
/// (exit code 2).
#[derive(clap::Args)]
pub struct Args {
    /// A checkpoint of `orator train gan` or `orator train seq2seq`, or its folder (the best checkpoint, else the newest, is taken).
    #[arg(long, value_name = "FILE|FOLDER", required_unless_present = "batch")]
    checkpoint: Option<PathBuf>,
    /// The speech.
    #[arg(long, value_name = "FILE", required_unless_present_any = ["audio_folder", "batch"], requires = "out")]
    audio: Option<PathBuf>,
    /// What is said in it, with times, for a network that reads words (.tsv, .json, .TextGrid, .ctm, .srt, .vtt).
    #[arg(long, value_name = "FILE", requires = "audio")]
    transcript: Option<PathBuf>,
    /// What to write; may be given several times.
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "audio")]
    out: Vec<PathBuf>,
    /// Speech in every file below this folder.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["audio", "batch"], requires = "out_folder")]
    audio_folder: Option<PathBuf>,
    /// A table (.csv) of speech.
    #[arg(long, value_name = "FILE", conflicts_with = "audio", requires = "out_folder")]
    batch: Option<PathBuf>,
    /// Where many motions go.
    #[arg(long, value_name = "DIR", conflicts_with = "audio")]
    out_folder: Option<PathBuf>,
    /// What many motions are written as: endings, divided by commas.
    #[arg(long, value_name = "ENDINGS", value_delimiter = ',', default_value = "bvh", conflicts_with = "audio")]
    format: Vec<String>,
    /// Make many motions again even where nothing changed.
    #[arg(long, conflicts_with = "audio")]
    again: bool,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let Some(audio) = &args.audio else { return batch::run(&batch(args)?, ui) };
    confine(args.out.iter().map(PathBuf::as_path), args.checkpoint.as_deref());
    let Some(given) = &args.checkpoint else { bail!("give --checkpoint") };
    let outputs = outputs(&args.out, |path| is_same_file(path, audio), "the speech itself", "")?;
    let checkpoint = checkpoint_file(given)?;
    if checkpoint != *given {
        ui.say(&format!("checkpoint {}", checkpoint.display()));
    }
    let _lock = model_lock(&checkpoint)?;
    let (speaker, fps, written, seam_jump, is_captured) = if is_sequence(&checkpoint)? {
        let speaker = SequenceGenerator::open(&checkpoint)?;
        let (written, jump) = write_sequence(&speaker, audio, args.transcript.as_deref(), &outputs, ui)?;
        (speaker.metadata.name.clone(), speaker.fps(), written, Some(jump), speaker.is_captured())
    } else {
        ensure!(args.transcript.is_none(), "{} reads no words: leave out --transcript", checkpoint.display());
        let speaker = GestureGenerator::open(&checkpoint)?;
        let written = write_motion(&speaker, audio, &outputs, ui)?;
        (speaker.name().to_owned(), speaker.fps(), written, None, false)
    };
    let speed = written.secs / written.motion_secs.max(1e-6);
    let names = names(&outputs);
    let note = written.note.as_ref().map_or(String::new(), |note| format!("note: {note}\n"));
    let seams = seam_jump.map_or(String::new(), |[raw, smoothed]| {
        format!("mean step over a seam of segments / elsewhere: {raw:.2} generated, {smoothed:.2} smoothed\n")
    });
    let text = format!(
        "{:.1} s of speech, {} frames of {speaker} at {fps}, {speed:.0} x real time\n{note}{seams}wrote {}",
        written.secs,
        written.n_frames,
        names.join(", ")
    );
    let said = args.transcript.as_ref().map_or(String::new(), |path| format!(" --transcript {}", path.display()));
    // A captured skeleton is written as .bvh alone.
    let next = next_output(&outputs).filter(|_| !is_captured).map(|out| {
        let (checkpoint, audio, out) = (given.display(), audio.display(), out.display());
        format!("orator generate --checkpoint {checkpoint} --audio {audio}{said} --out {out}")
    });
    let facts = json!({
        "audio_secs": written.secs,
        "n_frames": written.n_frames,
        "fps": fps,
        "times_real_time": speed,
        "checkpoint": checkpoint,
        "speaker": speaker,
        "seam_jump": seam_jump,
        "outputs": names,
        "note": written.note,
        "next": next,
    });
    ui.summary(&text, next.as_deref(), facts);
    Ok(Outcome::Done)
}

/// The batch that the arguments describe.
fn batch(args: Args) -> Result<SpeechBatch> {
    let folder = args.out_folder.context("give --out-folder, where the motions go")?;
    let sounds = match (&args.batch, &args.audio_folder) {
        (Some(table), _) => sounds::of_table(table)?,
        (None, Some(sounds)) => sounds::of_folder(sounds, &folder)?,
        (None, None) => bail!("give --audio, --audio-folder or --batch"),
    };
    Ok(SpeechBatch { sounds, folder, formats: args.format, checkpoint: args.checkpoint, again: args.again })
}
