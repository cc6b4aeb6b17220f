//! Learning rates and weight decay of the generator's layers: the layers of one speaker and of the words are not shared
//! by the speakers.

use orator_nn::gan::speaker_layer::SPEAKER;
use orator_nn::gan::words::WORDS;

/// Factor of the learning rate of the word layer, which has no weight decay: a rare word is in few batches.
const WORD_RATE: f64 = 5.0;

fn is_of_words(name: &str) -> bool {
    name.strip_prefix(WORDS).is_some_and(|rest| rest.starts_with('.'))
}

/// Whether a tensor is not shared by the speakers: that of the speaker layer and of the words.
pub(super) fn is_of_speaker(name: &str) -> bool {
    name.starts_with(SPEAKER) || is_of_words(name)
}

/// Factors of the learning rate and of the weight decay of a tensor; `shared` is that of the rate of shared tensors.
pub(super) fn factors(name: &str, shared: f64) -> [f64; 2] {
    match is_of_speaker(name) {
        true if is_of_words(name) => [WORD_RATE, 0.0],
        true => [1.0; 2],
        false => [shared, 1.0],
    }
}
