//! `orator generate`.

use super::{Outcome, ui::Ui};
use anyhow::{Context as _, Result, bail, ensure};
use orator::animate::file::{Format, Sources};
use orator::animate::{Options, perform};
use orator::generate::Speaker;
use orator::media::audio;
use orator::stage::progress::Progress as _;
use orator::train::checkpoint;
use orator::types::sound::{SAMPLE_RATE, Sound};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Turn speech into motion with a trained speaker.
///
/// The sound may be a wav, flac or mp3 file or the sound of a video, of any length. The ending of each output file
/// chooses what is written: .npy (joints [frames, 49, 3], metres), .txt (the layout of Rebol et al. 2021), .bvh (bone
/// rotations, cm, y up, facing +z), .mp4 (a film of the figure with the sound).
#[derive(clap::Args)]
pub struct Args {
    /// A checkpoint of `orator train gan`, or its folder (the best checkpoint, else the newest, is taken).
    #[arg(long, value_name = "FILE|FOLDER")]
    checkpoint: PathBuf,
    /// The speech.
    #[arg(long, value_name = "FILE")]
    audio: PathBuf,
    /// What to write; may be given several times.
    #[arg(long, value_name = "FILE", required = true, num_args = 1..)]
    out: Vec<PathBuf>,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let outputs = outputs(&args)?;
    let checkpoint = checkpoint_at(&args.checkpoint)?;
    if checkpoint != args.checkpoint {
        ui.say(&format!("checkpoint {}", checkpoint.display()));
    }
    let speaker = Speaker::open(&checkpoint)?;
    let started = Instant::now();
    let (sound, motion) = {
        let task = ui.begin("speech to motion", 0);
        task.detail("reading the sound");
        let sound = read_sound(&args.audio)?;
        task.detail(&format!("{:.1} s of sound", sound.secs()));
        let motion = speaker.motion(&sound).with_context(|| format!("no motion for {}", args.audio.display()))?;
        (sound, motion)
    };
    let motion_secs = started.elapsed().as_secs_f64();
    let performance = perform(&motion, None, &Options::default());
    let sources = Sources { sound: Some(&sound) };
    for (path, format) in &outputs {
        // Files of joints hold what the speaker said, before it is put on a figure.
        if format.holds_joints() {
            format.write_joints(path, &motion)?;
        } else {
            format.write(path, &performance, &sources, ui)?;
        }
    }
    let speed = sound.secs() / motion_secs.max(1e-6);
    let names: Vec<String> = outputs.iter().map(|(path, _)| path.display().to_string()).collect();
    let text = format!(
        "{:.1} s of speech, {} frames of {} at {}, {speed:.0} x real time\nwrote {}",
        sound.secs(),
        motion.n_frames(),
        speaker.name(),
        motion.fps,
        names.join(", ")
    );
    let next = next_command(&args, &outputs);
    let facts = json!({
        "audio_secs": sound.secs(),
        "n_frames": motion.n_frames(),
        "fps": motion.fps,
        "times_real_time": speed,
        "checkpoint": checkpoint,
        "speaker": speaker.name(),
        "outputs": names,
        "next": next,
    });
    ui.summary(&text, next.as_deref(), facts);
    Ok(Outcome::Done)
}

/// Output files with their formats; none may be the input or another output.
fn outputs(args: &Args) -> Result<Vec<(PathBuf, Format)>> {
    let same = |a: &Path, b: &Path| a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
    for (n, path) in args.out.iter().enumerate() {
        ensure!(!same(path, &args.audio), "{} is the speech itself; write to another file", path.display());
        ensure!(!args.out[..n].contains(path), "{} is asked for twice", path.display());
        ensure!(!path.is_dir(), "{} is a folder; name a file in it", path.display());
    }
    args.out.iter().map(|path| Ok((path.clone(), Format::of(path)?))).collect()
}

/// The checkpoint file meant by a file or a training's folder.
fn checkpoint_at(path: &Path) -> Result<PathBuf> {
    ensure!(path.exists(), "{} is not there; `orator train gan` makes checkpoints", path.display());
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let best = path.join("best.safetensors");
    if best.is_file() {
        return Ok(best);
    }
    let newest = checkpoint::list(path)?.pop();
    newest
        .map(|(_, file)| file)
        .with_context(|| format!("{} holds no checkpoint (best.safetensors or step-*.safetensors)", path.display()))
}

fn read_sound(path: &Path) -> Result<Sound> {
    ensure!(path.exists(), "{} is not there", path.display());
    ensure!(path.is_file(), "{} is no file", path.display());
    match audio::read_mono(path, SAMPLE_RATE)? {
        Some(sound) if !sound.samples.is_empty() => Ok(sound),
        Some(_) => bail!("{}: its sound track is empty", path.display()),
        None => bail!("{} has no sound track; give a file with speech", path.display()),
    }
}

/// The same again as a film, or for an animation program; nothing when both are there.
fn next_command(args: &Args, outputs: &[(PathBuf, Format)]) -> Option<String> {
    let missing = [(Format::Mp4, "mp4"), (Format::Bvh, "bvh")]
        .into_iter()
        .find(|&(format, _)| outputs.iter().all(|&(_, written)| written != format));
    let (_, extension) = missing?;
    let out = outputs.first()?.0.with_extension(extension);
    Some(format!(
        "orator generate --checkpoint {} --audio {} --out {}",
        args.checkpoint.display(),
        args.audio.display(),
        out.display()
    ))
}
