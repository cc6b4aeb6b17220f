//! Turns speech into motion with a trained speaker.
//!
//! ```text
//! cargo run --release --example generate_motion -- work/gan/host speech.wav gestures.bvh
//! ```

#![allow(clippy::print_stdout)] // a program

use anyhow::{Result, bail};
use orator::{
    AnimationOptions, ExportContent, ExportFormat, GestureGenerator, Silent, UnreadableMedia, perform, read_sound,
};
use std::path::{Path, PathBuf};

fn main() -> Result<()> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [checkpoint, speech, out] = paths.as_slice() else { bail!("expected CHECKPOINT SPEECH OUT.bvh") };
    match generate(checkpoint, speech, out) {
        Ok(line) => println!("{line}"),
        // Errors that a program handles apart have types.
        Err(error) if error.is::<UnreadableMedia>() => eprintln!("give another sound: {error:#}"),
        Err(error) => return Err(error),
    }
    Ok(())
}

/// Writes the motion of the checkpoint's speaker for a sound; gives a line on it.
pub(crate) fn generate(checkpoint: &Path, speech: &Path, out: &Path) -> Result<String> {
    let format = ExportFormat::from_path(out)?;
    let generator = GestureGenerator::open(checkpoint)?;
    let sound = read_sound(speech)?;
    let motion = generator.motion(&sound, &[])?;

    // A film (.mp4) has the sound; other formats do not use it.
    let performance = perform(&motion, None, &AnimationOptions::default());
    let content = ExportContent { sound: Some(&sound), ..ExportContent::default() };
    format.write(out, &performance, &content, &Silent)?;
    Ok(format!("{:.1} s of speech, {} frames of {}", sound.secs(), motion.n_frames(), generator.name()))
}
