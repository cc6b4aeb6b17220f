//! Notes below the table about checkpoints and compared joints.

use super::checkpoint::EvaluatedCheckpoint;
use super::clips::EvalClips;
use crate::generate::trained::TrainedSpeaker;
use orator_base::text::counted;
use orator_base::types::skeleton::{self, L_HAND, N_JOINTS, NECK, is_duplicate};
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::{Dataset, Split};
use orator_formats::transcript::Word;
use orator_nn::seq2seq::predict::StateAtSeams;

/// Notes on how the training data of the checkpoints differ from the evaluated split with these `words`, and on the
/// options of the sequence-to-sequence networks.
pub fn of_checkpoints(
    dataset: &Dataset,
    checkpoints: &[EvaluatedCheckpoint],
    words: &[Word],
    split: Split,
) -> Vec<String> {
    let mut notes = Vec::new();
    if split == Split::Train {
        notes
            .push("warning: the checkpoint was trained on this split, and its metrics measure memorisation".to_owned());
    }
    let (host, fps) = (&dataset.info().speaker, dataset.info().fps);
    let first_of_dataset = checkpoints.iter().position(|of| of.speaker.normalisation().is_some());
    for (at, checkpoint) in checkpoints.iter().enumerate() {
        let EvaluatedCheckpoint { name, speaker, .. } = checkpoint;
        let (model_speaker, is_first) = (speaker.name(), first_of_dataset == Some(at));
        if speaker.normalisation().is_none() {
            notes.push(format!(
                "{name} was trained on the captures {model_speaker}, not on this dataset: the takes of this split must be held out \
                 there. Its motion was imported like captures and has the bone lengths of the other predictors"
            ));
            if speaker.fps() != fps {
                notes.push(format!("the motion of {name} was resampled from {} to {fps}", speaker.fps()));
            }
        } else if host != model_speaker && is_first {
            notes.push(format!(
                "the dataset is of {host}, the checkpoint of {model_speaker}: the truth has the checkpoint's bone lengths"
            ));
        } else if host != model_speaker {
            notes.push(format!(
                "{name} is a model of {model_speaker}, not of {host}: it has the bone lengths of the other predictors"
            ));
        }
        if speaker.rate() != SAMPLE_RATE {
            notes.push(format!(
                "{name} was trained on audio at {} Hz; the dataset has audio at {SAMPLE_RATE} Hz, without frequencies above {} Hz, \
                 which may degrade its motion",
                speaker.rate(),
                SAMPLE_RATE / 2
            ));
        }
        if checkpoint.seams() == Some(StateAtSeams::Carried) {
            notes.push(format!("{name} carries its decoder state across segments"));
        }
        if let TrainedSpeaker::Sequence(network) = speaker
            && let Some(n_from_table) = network.n_from_table(words)
        {
            let n_known = network.metadata.vocabulary.n_known(words);
            let n_words = counted(words.len(), "word");
            notes.push(format!(
                "{n_known} of {n_words} of this split are in the vocabulary of {name}, {n_from_table} of the others in \
                 the table of word vectors"
            ));
        }
        if speaker.n_words() > 0 && words.is_empty() {
            notes.push(format!(
                "{name} uses words, and this split has none: its motion is generated from the audio only"
            ));
        }
    }
    notes
}

/// Note on the joints that are compared, if not all are, and on how often all of these are visible.
pub fn of_joints(clips: &EvalClips, common: &[usize]) -> String {
    let missing = || (NECK + 1..N_JOINTS).filter(|joint| !common.contains(joint));
    let is_finger = |joint: &usize| *joint > L_HAND && !is_duplicate(*joint);
    let n_fingers = missing().filter(is_finger).count();
    let fingers = (n_fingers > 0).then(|| counted(n_fingers, "finger joint"));
    let others = missing().filter(|joint| !is_finger(joint)).map(skeleton::name);
    let left_out: Vec<String> = fingers.into_iter().chain(others).collect();
    let is_complete =
        |seen: ndarray::ArrayView1<bool>| common.iter().filter(|joint| **joint != NECK).all(|joint| seen[*joint]);
    let n_whole: usize =
        clips.clips.iter().map(|clip| clip.mask.outer_iter().filter(|seen| is_complete(*seen)).count()).sum();
    let share = 100.0 * n_whole as f64 / clips.n_frames().max(1) as f64;
    format!(
        "all rows, including the truth, are measured on the joints that all predictors have, {} of {}; left out: {}. These \
         joints are all visible in {share:.1} % of the frames",
        counted(common.iter().filter(|joint| **joint != NECK).count(), "joint"),
        N_JOINTS - 1,
        left_out.join(", ")
    )
}
