//! Words of a training: the vocabulary of the training splits, and word dropout.

use crate::generate::seq2seq::architecture::{UNKNOWN, Vocabulary};
use crate::generate::word_input::TrainedWords;
use anyhow::{Result, ensure};
use candle_core::Tensor;
use orator_base::stage::progress::Progress;
use orator_base::text::counted;
use orator_dataset::{Dataset, Split};
use orator_formats::word_vectors::WordVectors;
use orator_nn::gan::words::WordFrames;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Share of the vocabulary that is unknown in a step, so that the vector of unknown words is trained.
const UNKNOWN_SHARE: f64 = 0.1;
/// Share of the windows of a step without any words, so that the network also generates motion without a transcript.
const WORDLESS_SHARE: f64 = 0.1;

/// Words of the training splits, with the number of those in the table `vectors` reported to `progress`.
///
/// # Errors
/// No words in any dataset; a sample that cannot be read.
pub fn vocabulary(
    datasets: &[&Dataset],
    vectors: Option<&WordVectors>,
    progress: &dyn Progress,
) -> Result<TrainedWords> {
    let mut spoken = Vec::new();
    for dataset in datasets {
        for sample in dataset.samples(Split::Train) {
            spoken.extend(dataset.words(&sample)?.unwrap_or_default());
        }
    }
    let vocabulary = Vocabulary::of(&spoken);
    let names = || datasets.iter().map(|dataset| dataset.dir().display().to_string()).collect::<Vec<_>>().join(", ");
    ensure!(
        !vocabulary.words().is_empty(),
        "gan.words is true, but the training split of {} has no words: give transcripts under [[speaker]] and build the \
         dataset again, or set gan.words = false",
        names()
    );
    let n_words = counted(vocabulary.words().len(), "word");
    progress.say(&match vectors {
        None => format!("vocabulary of {n_words}"),
        Some(vectors) => {
            let n_known = vectors.n_known(vocabulary.words().iter().map(String::as_str));
            format!("{n_known} of {n_words} have pretrained vectors")
        }
    });
    Ok(TrainedWords { vocabulary, has_word_vectors: vectors.is_some() })
}

/// Makes a random share of the `n_indices` word indices unknown, and removes all words of some windows.
pub fn dropped(words: &WordFrames, n_indices: usize, rng: &mut ChaCha8Rng) -> Result<WordFrames> {
    let (shape, device) = (words.numbers.shape(), words.numbers.device());
    let mut number = |number: u32| match number > UNKNOWN && rng.random_bool(UNKNOWN_SHARE) {
        true => UNKNOWN,
        false => number,
    };
    let numbers: Vec<u32> = (0..n_indices as u32).map(&mut number).collect();
    let has_words: Vec<u32> = (0..shape.dims()[0]).map(|_| u32::from(!rng.random_bool(WORDLESS_SHARE))).collect();
    let has_words = Tensor::new(has_words, device)?.unsqueeze(1)?;
    let numbers = Tensor::new(numbers, device)?.index_select(&words.numbers.flatten_all()?, 0)?.reshape(shape)?;
    Ok(WordFrames {
        numbers: numbers.broadcast_mul(&has_words)?,
        times: words.times.broadcast_mul(&has_words.unsqueeze(2)?.to_dtype(words.times.dtype())?)?,
        added: None,
    })
}
