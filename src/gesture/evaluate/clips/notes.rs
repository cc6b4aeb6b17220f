//! Notes below the table about checkpoints and compared joints.

use super::checkpoint::EvaluatedCheckpoint;
use super::clips::EvalClips;
use orator_base::text::counted;
use orator_base::types::skeleton::{self, L_HAND, N_JOINTS, NECK, is_duplicate};
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::{Dataset, Split};

/// Notes on how the training data of the checkpoints differ from the evaluated split; `has_words`: whether the split
/// has any.
pub fn of_checkpoints(
    dataset: &Dataset,
    checkpoints: &[EvaluatedCheckpoint],
    has_words: bool,
    split: Split,
) -> Vec<String> {
    let mut notes = Vec::new();
    if split == Split::Train {
        notes.push("THE CHECKPOINT WAS TRAINED ON THIS SPLIT: its figures say what it learnt by heart".to_owned());
    }
    let (host, fps) = (&dataset.info().speaker, dataset.info().fps);
    let first_of_dataset = checkpoints.iter().position(|of| of.speaker.normalisation().is_some());
    for (at, EvaluatedCheckpoint { name, speaker }) in checkpoints.iter().enumerate() {
        let (model_speaker, is_first) = (speaker.name(), first_of_dataset == Some(at));
        if speaker.normalisation().is_none() {
            notes.push(format!(
                "{name} learnt the captures {model_speaker}, not this dataset: hold out there the takes of this split, else it knows \
                 them; its motion was read as the captures' import reads them, its bones put on the lengths of the others"
            ));
            if speaker.fps() != fps {
                notes.push(format!("{name} moves at {}: resampled to {fps}", speaker.fps()));
            }
        } else if host != model_speaker && is_first {
            notes.push(format!(
                "the dataset is of {host}, the checkpoint of {model_speaker}: its bones were put on the checkpoint's lengths"
            ));
        } else if host != model_speaker {
            notes.push(format!(
                "{name} is of {model_speaker}, not of {host}: its bones were put on the lengths of the others"
            ));
        }
        if speaker.rate() != SAMPLE_RATE {
            notes.push(format!(
                "{name} learnt from sound at {} Hz and hears the dataset's at {SAMPLE_RATE} Hz, which has nothing above {} Hz: \
                 it hears worse here than it could",
                speaker.rate(),
                SAMPLE_RATE / 2
            ));
        }
        if speaker.n_words() > 0 && !has_words {
            notes.push(format!("{name} reads words, and this split has none: it hears the sound alone"));
        }
    }
    notes
}

/// Note on the joints that are compared, if not all are, and on how often all of these are visible.
pub fn of_joints(clips: &EvalClips, common: &[usize]) -> String {
    let missing = || (NECK + 1..N_JOINTS).filter(|joint| !common.contains(joint));
    let is_finger = |joint: &usize| *joint > L_HAND && !is_duplicate(*joint);
    let n_fingers = missing().filter(is_finger).count();
    let fingers = (n_fingers > 0).then(|| format!("{n_fingers} finger joints"));
    let others = missing().filter(|joint| !is_finger(joint)).map(skeleton::name);
    let left_out: Vec<String> = fingers.into_iter().chain(others).collect();
    let is_whole =
        |seen: ndarray::ArrayView1<bool>| common.iter().filter(|joint| **joint != NECK).all(|joint| seen[*joint]);
    let n_whole: usize =
        clips.clips.iter().map(|clip| clip.mask.outer_iter().filter(|seen| is_whole(*seen)).count()).sum();
    let share = 100.0 * n_whole as f64 / clips.n_frames().max(1) as f64;
    format!(
        "every row, the truth's too, is measured on the joints that all have, {} of {}; left out: {}. All of them are seen \
         in {share:.1} % of the frames",
        counted(common.iter().filter(|joint| **joint != NECK).count(), "joint"),
        N_JOINTS - 1,
        left_out.join(", ")
    )
}
