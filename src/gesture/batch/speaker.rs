//! A trained speaker of either kind writes the motion for a sound to files.

use super::motion_files::write_motion;
use super::sequence_files::write_sequence;
use super::spoken::{SpeechSource, SpokenMotion};
use crate::generate::trained::TrainedSpeaker;
use anyhow::{Result, ensure};
use orator_avatar::animate::export::file::ExportFormat;
use orator_base::stage::progress::Progress;
use orator_nn::seq2seq::predict::StateAtSeams;
use std::path::PathBuf;

/// Writes the motion for a sound to `outputs`. Errors name the sound, or what this kind of network cannot do.
pub fn write(
    speaker: &TrainedSpeaker,
    speech: &SpeechSource,
    outputs: &[(PathBuf, ExportFormat)],
    progress: &dyn Progress,
) -> Result<SpokenMotion> {
    match speaker {
        TrainedSpeaker::Gan(speaker) => {
            let name = speaker.name();
            ensure!(speech.transcript.is_none(), "the speaker {name} reads no words: leave out --transcript");
            ensure!(
                speech.seams == StateAtSeams::Renewed,
                "the speaker {name} makes no segments, and has no state: leave out --carry-state"
            );
            write_motion(speaker, speech, outputs, progress)
        }
        TrainedSpeaker::Sequence(speaker) => write_sequence(speaker, speech, outputs, progress),
    }
}
