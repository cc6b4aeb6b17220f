//! Generates motion for one sound and its optional transcript with a sequence-to-sequence network, and writes it to
//! files.

use super::motion_files::{measure, write_outputs};
use super::speech::{MotionReport, SegmentFacts, SpeechSource};
use crate::generate::seq2seq::SequenceGenerator;
use anyhow::{Context as _, Result, bail, ensure};
use orator_avatar::animate::export::file::{ExportFormat, FigureOptions};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::text::counted;
use orator_dataset::words;
use orator_formats::transcript::{Transcript, after_end};
use orator_media::ffmpeg::{audio, origin};
use orator_nn::seq2seq::predict::StateAtSeams;
use std::path::{Path, PathBuf};
use std::time::Instant;

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
    let &SpeechSource { audio, transcript, carry_state, figure } = speech;
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
    let mut parsed = transcript.map(Transcript::read).transpose()?;
    let task = progress.begin("speech to motion", 0);
    measure(audio)?;
    let sound = audio::read_mono_with_note(audio, speaker.metadata.rate)?;
    let (sound, phase_note) = sound.with_context(|| format!("{} has no audio", audio.display()))?;
    if let Some(parsed) = &mut parsed {
        words::from_secs(&mut parsed.words, origin::start_secs(audio)?);
    }
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
    let words_from_table = parsed.as_ref().and_then(|parsed| speaker.n_from_table(&parsed.words));
    let notes = transcript.zip(parsed).map(|(path, parsed)| notes(speaker, path, &parsed, sound.secs()));
    let notes: Vec<String> = phase_note.into_iter().chain(notes.into_iter().flatten()).collect();
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

/// Notes about problems of a transcript.
fn notes(speaker: &SequenceGenerator, path: &Path, parsed: &Transcript, sound_secs: f64) -> Vec<String> {
    if !speaker.reads_words() {
        return vec![format!("the network does not use words: {} was ignored", path.display())];
    }
    let n_read = speaker.metadata.vocabulary.n_known(&parsed.words) + speaker.n_from_table(&parsed.words).unwrap_or(0);
    let is_unknown = !parsed.words.is_empty() && n_read == 0;
    let unknown = is_unknown.then(|| {
        format!(
            "no word of the transcript ({}) is in the network's vocabulary: is it in the language of the training?",
            counted(parsed.words.len(), "word")
        )
    });
    parsed.notes.iter().cloned().chain(after_end(&parsed.words, sound_secs)).chain(unknown).collect()
}
