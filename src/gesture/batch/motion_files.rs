//! Generates the motion for one sound and writes it to files. The sound is streamed, so that apart from the motion,
//! memory does not grow with its length; only a film, which contains the sound, reads it completely.

use super::sequence_files::write_sequence;
use super::speech::{MotionReport, SpeechSource};
use crate::generate::GestureGenerator;
use crate::generate::generator::CHUNK;
use crate::generate::trained::TrainedSpeaker;
use anyhow::{Context as _, Result, ensure};
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::audio::mel;
use orator_base::stage::progress::Progress;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::SAMPLE_RATE;
use orator_media::ffmpeg::sound_stream::{self, SoundStream};
use orator_media::ffmpeg::{UnreadableMedia, audio, probe};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Generates motion for a sound with a GAN and writes it to `outputs`. Errors name the sound.
pub fn write_motion(
    speaker: &GestureGenerator,
    speech: &SpeechSource,
    outputs: &[(PathBuf, ExportFormat)],
    progress: &dyn Progress,
) -> Result<MotionReport> {
    let audio = speech.audio;
    let started = Instant::now();
    let task = progress.begin("speech to motion", 0);
    task.detail("reading the audio");
    let (n_samples, note) = measure(audio)?;
    let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
    let no_motion = || format!("cannot generate motion for {}", audio.display());
    let n_frames = speaker.n_frames(n_samples).with_context(no_motion)?;
    drop(task);
    let task = progress.begin("speech to motion", n_frames as u64);
    task.detail(&format!("{secs:.1} s of audio"));
    let pieces = SoundStream::open(audio, SAMPLE_RATE);
    let (motion, posture) = speaker
        .motion_from_stream(pieces, n_samples, CHUNK, &mut |n| task.advance(n as u64))
        .with_context(no_motion)?;
    drop(task);
    let motion_secs = started.elapsed().as_secs_f64();
    write_outputs((motion, posture), speech, outputs, progress)?;
    Ok(MotionReport { secs, n_frames, motion_secs, note, segments: None })
}

/// Writes motion to files of all formats.
pub(super) fn write_outputs(
    (motion, posture): (Motion, Option<Posture>),
    &SpeechSource { audio, figure, .. }: &SpeechSource,
    outputs: &[(PathBuf, ExportFormat)],
    progress: &dyn Progress,
) -> Result<()> {
    // Joint files contain the network output, before it is applied to a figure.
    let (joints, figures): (Vec<_>, Vec<_>) = outputs.iter().partition(|(_, format)| format.holds_joints());
    for (path, format) in joints {
        format.write_joints(path, &motion)?;
    }
    if !figures.is_empty() {
        let performance =
            perform(&motion, posture.as_ref(), &AnimationOptions { fps: figure.fps, ..AnimationOptions::default() });
        let posture = posture.as_ref().map(|posture| (motion.fps, posture));
        drop(motion);
        let is_film = figures.iter().any(|(_, format)| *format == ExportFormat::Mp4);
        let sound = if is_film { audio::read_mono(audio, SAMPLE_RATE)? } else { None };
        let sources = ExportContent {
            sound: sound.as_ref(),
            names: figure.names,
            film_fps: figure.fps,
            posture,
            ..ExportContent::default()
        };
        for (path, format) in figures {
            format.write(path, &performance, &sources, progress)?;
        }
    }
    Ok(())
}

/// Number of samples of the sound at 16 kHz, and a note about its quality, if any.
///
/// # Errors
/// A path that is not a file, or a file without sound.
pub(super) fn measure(path: &Path) -> Result<(usize, Option<String>)> {
    ensure!(path.exists(), "{} does not exist", path.display());
    ensure!(path.is_file(), "{} is not a file", path.display());
    let info = probe::probe(path)?;
    let name = path.display();
    let Some(track) = info.audio else {
        return Err(UnreadableMedia(format!("{name} has no audio track; give a file with speech")).into());
    };
    match sound_stream::n_samples(path, SAMPLE_RATE)? {
        Some((n, phase)) if n > 0 => {
            let notes: Vec<String> = phase.into_iter().chain(narrow_band_note(track.rate)).collect();
            Ok((n, (!notes.is_empty()).then(|| notes.join("; "))))
        }
        _ => {
            let problem = format!("{name}: the audio track ({}) has no samples; give a file with speech", track.codec);
            Err(UnreadableMedia(problem).into())
        }
    }
}

/// Note if the sample rate (Hz) is too low for the spectrogram.
fn narrow_band_note(rate: u32) -> Option<String> {
    let highest_hz = f64::from(rate) / 2.0;
    if rate == 0 || highest_hz >= mel::HIGHEST_HZ {
        return None;
    }
    let n_empty = (0..mel::N_MELS).filter(|band| mel::lowest_hz(*band) >= highest_hz).count();
    Some(format!(
        "the audio has a sample rate of {rate} Hz: {n_empty} of the {} mel bands are empty (above {highest_hz:.0} Hz), and \
         the motion is generated as for muffled speech",
        mel::N_MELS
    ))
}

/// Generates motion for a sound and writes it to `outputs`. Errors name the sound, or the option that this kind of
/// network does not support.
pub fn write(
    speaker: &TrainedSpeaker,
    speech: &SpeechSource,
    outputs: &[(PathBuf, ExportFormat)],
    progress: &dyn Progress,
) -> Result<MotionReport> {
    ensure!(
        !speech.carry_state || speaker.has_state(),
        "the model of {} has no decoder state: omit --carry-state",
        speaker.name()
    );
    match speaker {
        TrainedSpeaker::Gan(speaker) => {
            let name = speaker.name();
            ensure!(speech.transcript.is_none(), "the model of {name} does not use words: omit --transcript");
            write_motion(speaker, speech, outputs, progress)
        }
        TrainedSpeaker::Sequence(speaker) => write_sequence(speaker, speech, outputs, progress),
    }
}

#[cfg(test)]
mod tests {
    use super::narrow_band_note;

    #[test]
    fn narrow_band_sound_gives_a_note() {
        assert_eq!(narrow_band_note(16_000), None);
        assert_eq!(narrow_band_note(44_100), None);
        let text = narrow_band_note(8000).unwrap();
        assert!(text.contains("4000 Hz") && text.contains("of the 64 mel bands"), "{text}");
    }
}
