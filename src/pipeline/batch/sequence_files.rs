//! One sound, and where there is one its transcript, to motion by a sequence-to-sequence network, to files.

use super::motion_files::{SpokenMotion, measure, write_outputs};
use crate::animate::export::file::ExportFormat;
use crate::external::ffmpeg::audio;
use crate::formats::transcript::Transcript;
use crate::generate::seq2seq::SequenceGenerator;
use crate::stage::progress::Progress;
use crate::stage::workdir;
use anyhow::{Context as _, Result, bail};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Motion of a speaker for one sound, written to `outputs`; and the jump at the seams of its segments, as generated and
/// smoothed. A network that learnt captures writes its own skeleton, as .bvh alone.
///
/// # Errors
/// A sound or transcript that cannot be read, a sound shorter than a frame, another format for a captured skeleton.
pub fn write_sequence(
    speaker: &SequenceGenerator,
    audio: &Path,
    transcript: Option<&Path>,
    outputs: &[(PathBuf, ExportFormat)],
    progress: &dyn Progress,
) -> Result<(SpokenMotion, [f64; 2])> {
    let started = Instant::now();
    let is_captured = speaker.is_captured();
    if let Some((path, _)) = outputs.iter().find(|(_, format)| is_captured && *format != ExportFormat::Bvh) {
        bail!(
            "{}: this network moves the skeleton of the BVH files it was trained on, which is written as .bvh alone",
            path.display()
        );
    }
    let words = transcript.map(Transcript::read).transpose()?.unwrap_or_default().words;
    let task = progress.begin("speech to motion", 0);
    measure(audio)?;
    let sound = audio::read_mono(audio, speaker.metadata.rate)?;
    let sound = sound.with_context(|| format!("{} has no sound", audio.display()))?;
    let poses = speaker.poses(&sound, &words).with_context(|| format!("no motion for {}", audio.display()))?;
    drop(task);
    let motion_secs = started.elapsed().as_secs_f64();
    if is_captured {
        let text = speaker.bvh(&poses)?;
        outputs.iter().try_for_each(|(path, _)| workdir::write_file(path, text.as_bytes()))?;
    } else {
        write_outputs(speaker.motion(&poses)?, audio, outputs, progress)?;
    }
    let n_frames = poses.numbers.nrows();
    Ok((SpokenMotion { secs: sound.secs(), n_frames, motion_secs, note: None }, poses.seam_jump))
}
