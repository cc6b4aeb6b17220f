//! Generates the motion for one sound, with its transcript for some networks, and writes it to files. The sound is
//! streamed, so that apart from the motion, memory does not grow with its length; only a film reads it completely.

use super::speech::{MotionReport, SegmentFacts, SpeechSource};
use crate::generate::GestureGenerator;
use crate::generate::generator::CHUNK;
use crate::generate::seq2seq::SequenceGenerator;
use crate::generate::trained::TrainedSpeaker;
use crate::generate::word_input::KnownWords;
use anyhow::{Context as _, Result, bail, ensure};
use orator_avatar::animate::export::file::{ExportContent, ExportFormat, FigureOptions};
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::audio::mel;
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::text::counted;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::words;
use orator_formats::transcript::{Transcript, after_end};
use orator_media::ffmpeg::sound_stream::{self, SoundStream};
use orator_media::ffmpeg::{UnreadableMedia, audio, origin, probe};
use orator_nn::seq2seq::predict::StateAtSeams;
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
    let transcript = transcript(speech)?;
    let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
    let no_motion = || format!("cannot generate motion for {}", audio.display());
    let n_frames = speaker.n_frames(n_samples).with_context(no_motion)?;
    drop(task);
    let task = progress.begin("speech to motion", n_frames as u64);
    task.detail(&format!("{secs:.1} s of audio"));
    let pieces = SoundStream::open(audio, SAMPLE_RATE);
    let words = transcript.as_ref().map_or(&[][..], |transcript| &transcript.words);
    let (motion, posture) = speaker
        .motion_from_stream(pieces, n_samples, words, CHUNK, &mut |n| task.advance(n as u64))
        .with_context(no_motion)?;
    drop(task);
    let motion_secs = started.elapsed().as_secs_f64();
    write_outputs((motion, posture), speech, outputs, progress)?;
    let words = speaker.known_words().map(|known_words| word_notes(known_words, transcript.as_ref(), secs));
    let notes: Vec<String> = note.into_iter().chain(words.into_iter().flatten()).collect();
    let note = (!notes.is_empty()).then(|| notes.join("; "));
    Ok(MotionReport { secs, n_frames, motion_secs, note, segments: None })
}

/// Transcript of the speech, if there is one, with times from the start of the sound.
fn transcript(speech: &SpeechSource) -> Result<Option<Transcript>> {
    let mut parsed = speech.transcript.map(Transcript::read).transpose()?;
    if let Some(parsed) = &mut parsed {
        words::from_secs(&mut parsed.words, origin::start_secs(speech.audio)?);
    }
    Ok(parsed)
}

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

/// Generates motion for a sound and writes it to `outputs`. Errors name the sound or the unsupported option.
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
            let (name, reads_words) = (speaker.name(), speaker.known_words().is_some());
            ensure!(
                speech.transcript.is_none() || reads_words,
                "the model of {name} does not use words: omit --transcript"
            );
            write_motion(speaker, speech, outputs, progress)
        }
        TrainedSpeaker::Sequence(speaker) => write_sequence(speaker, speech, outputs, progress),
    }
}

/// Generates motion for one sound and writes it to `outputs`. Motion of a captured skeleton can only be written as BVH.
///
/// # Errors
/// A sound or transcript that cannot be read; a sound shorter than a frame; another format than BVH, or figure options,
/// for a captured skeleton.
pub fn write_sequence(
    speaker: &SequenceGenerator,
    speech: &SpeechSource,
    outputs: &[(PathBuf, ExportFormat)],
    progress: &dyn Progress,
) -> Result<MotionReport> {
    let &SpeechSource { audio, carry_state, figure, .. } = speech;
    let started = Instant::now();
    let is_captured = speaker.is_captured();
    if let Some((path, _)) = outputs.iter().find(|(_, format)| is_captured && *format != ExportFormat::Bvh) {
        bail!("{}: this network animates the BVH skeleton it was trained on: expected a .bvh file", path.display());
    }
    ensure!(
        !is_captured || figure == FigureOptions::default(),
        "this network animates the BVH skeleton it was trained on, with its bone names and frame rate: omit \
         --names and --fps"
    );
    let task = progress.begin("speech to motion", 0);
    measure(audio)?;
    let parsed = transcript(speech)?;
    let sound = audio::read_mono_with_note(audio, speaker.metadata.rate)?;
    let (sound, phase_note) = sound.with_context(|| format!("{} has no audio", audio.display()))?;
    let words = parsed.as_ref().map_or(&[][..], |parsed| &parsed.words);
    let no_motion = || format!("cannot generate motion for {}", audio.display());
    let seams = speaker.seams(carry_state);
    let input = speaker.prepare(&sound, words).with_context(no_motion)?;
    let poses = speaker.generate(&input, seams).with_context(no_motion)?;
    let motion_secs = started.elapsed().as_secs_f64();
    let other = match seams {
        StateAtSeams::Renewed => StateAtSeams::Carried,
        StateAtSeams::Carried => StateAtSeams::Renewed,
    };
    let other_seam_jump = speaker.generate(&input, other).with_context(no_motion)?.seam_jump;
    drop((task, input));
    if is_captured {
        let text = speaker.bvh(&poses)?;
        outputs.iter().try_for_each(|(path, _)| workdir::write_file(path, text.as_bytes()))?;
    } else {
        write_outputs((speaker.motion(&poses)?, None), speech, outputs, progress)?;
    }
    let known = parsed.as_ref().map(|parsed| [parsed.words.len(), speaker.metadata.vocabulary.n_known(&parsed.words)]);
    let known_words = speaker.known_words();
    let words_from_table = parsed.as_ref().and_then(|parsed| known_words.n_from_table(&parsed.words));
    let notes = match (speaker.reads_words(), speech.transcript) {
        (true, Some(_)) => word_notes(known_words, parsed.as_ref(), sound.secs()),
        (false, Some(path)) => vec![format!("the network does not use words: {} was ignored", path.display())],
        (_, None) => Vec::new(),
    };
    let notes: Vec<String> = phase_note.into_iter().chain(notes).collect();
    Ok(MotionReport {
        secs: sound.secs(),
        n_frames: poses.features.nrows(),
        motion_secs,
        note: (!notes.is_empty()).then(|| notes.join("; ")),
        segments: Some(SegmentFacts {
            state: seams,
            seam_jump: poses.seam_jump,
            other_seam_jump,
            words: known.filter(|_| speaker.reads_words()),
            words_from_table,
        }),
    })
}

/// Notes on the words of a speech of `sound_secs` for a network that reads words.
fn word_notes(known_words: KnownWords, transcript: Option<&Transcript>, sound_secs: f64) -> Vec<String> {
    let Some(Transcript { words, notes, .. }) = transcript else {
        return vec!["no words were given (--transcript): the motion depends on the audio only".to_owned()];
    };
    let n_read = known_words.vocabulary.n_known(words) + known_words.n_from_table(words).unwrap_or(0);
    let is_unknown = !words.is_empty() && n_read == 0;
    let unknown = is_unknown.then(|| {
        format!(
            "no word of the transcript ({}) is in the network's vocabulary: is it in the language of the training?",
            counted(words.len(), "word")
        )
    });
    notes.iter().cloned().chain(after_end(words, sound_secs)).chain(unknown).collect()
}
