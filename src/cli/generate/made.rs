//! One sound to motion to files. The sound is streamed, so its length costs no memory but for its motion; only a film, which
//! holds the sound, reads it whole.

use anyhow::{Context as _, Result, bail, ensure};
use orator::animate::export::file::{ExportContent, ExportFormat};
use orator::animate::{AnimationOptions, perform};
use orator::audio::mel;
use orator::external::ffmpeg::sound_stream;
use orator::external::ffmpeg::sound_stream::SoundStream;
use orator::external::ffmpeg::{audio, probe};
use orator::generate::Speaker;
use orator::stage::progress::Progress;
use orator::types::sound::SAMPLE_RATE;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What became of a sound.
pub struct Made {
    pub secs: f64,
    pub n_frames: usize,
    /// Seconds it took to make the motion, files not counted.
    pub motion_secs: f64,
    /// What a user should know of the sound.
    pub note: Option<String>,
}

/// Makes the motion of `speaker` for the sound of `audio` and writes it to `outputs`. Errors name the sound.
pub fn make(
    speaker: &Speaker,
    audio: &Path,
    outputs: &[(PathBuf, ExportFormat)],
    progress: &dyn Progress,
) -> Result<Made> {
    let started = Instant::now();
    let task = progress.begin("speech to motion", 0);
    task.detail("listening");
    let (n_samples, note) = look_at(audio)?;
    let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
    let no_motion = || format!("no motion for {}", audio.display());
    let n_frames = speaker.n_frames(n_samples).with_context(no_motion)?;
    drop(task);
    let task = progress.begin("speech to motion", n_frames as u64);
    task.detail(&format!("{secs:.1} s of sound"));
    let pieces = SoundStream::open(audio, SAMPLE_RATE);
    let motion =
        speaker.motion_of_pieces(pieces, n_samples, &mut |n| task.advance(n as u64)).with_context(no_motion)?;
    drop(task);
    let motion_secs = started.elapsed().as_secs_f64();
    // Files of joints hold what the speaker said, before it is put on a figure.
    let (joints, figures): (Vec<_>, Vec<_>) = outputs.iter().partition(|(_, format)| format.holds_joints());
    for (path, format) in joints {
        format.write_joints(path, &motion)?;
    }
    if !figures.is_empty() {
        let performance = perform(&motion, None, &AnimationOptions::default());
        drop(motion);
        let is_film = figures.iter().any(|(_, format)| *format == ExportFormat::Mp4);
        let sound = if is_film { audio::read_mono(audio, SAMPLE_RATE)? } else { None };
        let sources = ExportContent { sound: sound.as_ref(), ..ExportContent::default() };
        for (path, format) in figures {
            format.write(path, &performance, &sources, progress)?;
        }
    }
    Ok(Made { secs, n_frames, motion_secs, note })
}

/// Samples of the sound at our rate, and what should be said of it.
fn look_at(path: &Path) -> Result<(usize, Option<String>)> {
    ensure!(path.exists(), "{} is not there", path.display());
    ensure!(path.is_file(), "{} is no file", path.display());
    let said = probe::probe(path)?;
    let Some(track) = said.audio else { bail!("{} has no sound track; give a file with speech", path.display()) };
    match sound_stream::n_samples(path, SAMPLE_RATE)? {
        Some(n) if n > 0 => Ok((n, narrow(track.rate))),
        _ => bail!("{}: its sound track ({}) holds no samples; give a file with speech", path.display(), track.codec),
    }
}

/// What a rate too low for the spectrogram means.
fn narrow(rate: u32) -> Option<String> {
    let highest_hz = f64::from(rate) / 2.0;
    if rate == 0 || highest_hz >= mel::HIGHEST_HZ {
        return None;
    }
    let n_empty = (0..mel::N_MELS).filter(|band| mel::lowest_hz(*band) >= highest_hz).count();
    Some(format!(
        "the sound has {rate} samples a second, so nothing above {highest_hz:.0} Hz: {n_empty} of the {} mel bands a speaker \
         listens to are empty, and it gestures as to muffled speech",
        mel::N_MELS
    ))
}

#[cfg(test)]
mod tests {
    use super::narrow;

    #[test]
    fn a_telephone_is_told_of() {
        assert_eq!(narrow(16_000), None);
        assert_eq!(narrow(44_100), None);
        let text = narrow(8000).unwrap();
        assert!(text.contains("4000 Hz") && text.contains("of the 64 mel bands"), "{text}");
    }
}
