//! Initial word embeddings of a network that reads words.

use crate::generate::seq2seq::architecture::{PADDING, UNKNOWN, Vocabulary};
use anyhow::{Context, Result};
use candle_core::{Device, Tensor};
use orator_formats::word_vectors::WordVectors;
use orator_nn::params::Params;
use orator_nn::seq2seq::encoders::{set_word_vectors, table_name};

/// Dimension of the word embeddings if no word vectors are given.
pub const WORD_DIM: usize = 100;

/// Initialises the word embeddings of the encoder of this name: zeros for padding, ones for the unknown word, and the
/// given vectors for all others, which are random without.
pub fn initialise(
    params: &Params,
    encoder: &str,
    vocabulary: &Vocabulary,
    vectors: Option<&WordVectors>,
) -> Result<()> {
    let found = params.trainables().find(|(name, _)| *name == table_name(encoder));
    let (_, table) = found.context("the network has no word embedding")?;
    let dim = table.dim(1)?;
    let mut rows = table.to_device(&Device::Cpu)?.to_vec2::<f32>()?;
    rows[PADDING as usize] = vec![0.0; dim];
    rows[UNKNOWN as usize] = vec![1.0; dim];
    if let Some(vectors) = vectors {
        for word in vocabulary.words() {
            rows[vocabulary.number(word) as usize] = vectors.vector(vectors.index(word))?;
        }
    }
    let table = Tensor::from_vec(rows.concat(), (vocabulary.n_indices(), dim), &Device::Cpu)?;
    Ok(set_word_vectors(params, encoder, &table)?)
}
