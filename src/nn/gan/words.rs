//! Word input of the generator: at each pose frame the embedding of the word that is spoken, and the times since its
//! start and until its end. One convolution over two seconds maps them directly to the input of the last layer: where
//! they were added to the encoded audio instead, or as well, networks memorised ten minutes of speech without learning
//! the words. Initial embeddings are small, so that words without a gesture hardly disturb the others.

use crate::ops::conv2d::Conv;
use crate::params::{Init, Params};
use crate::seq2seq::encoders::table_name;
use candle_core::{DType, Device, Result, Tensor};
use std::ops::Range;

/// Name of the layer, whose tensors are `words.embedding.weight` and `words.output`.
pub const WORDS: &str = "words";
/// Number of times per frame.
pub const N_TIMES: usize = 2;
/// Range of the initial embeddings.
const INITIAL: f64 = 0.03;
/// Number of frames that the convolution reads.
pub const KERNEL: usize = 31;

/// Words at the pose frames of a batch of sounds.
#[derive(Clone, Debug)]
pub struct WordFrames {
    /// Index of the word at each frame, u32 [B, T]; 0: none.
    pub numbers: Tensor,
    /// Seconds since the start and until the end of the word, [B, T, 2]; 0 without a word.
    pub times: Tensor,
    /// Vectors [n, dim] of the indices after those of the embedding table.
    pub added: Option<Tensor>,
}

impl WordFrames {
    /// Copies the words to a device.
    pub fn on(&self, device: &Device) -> Result<Self> {
        let added = self.added.as_ref().map(|added| added.to_device(device)).transpose()?;
        Ok(Self { numbers: self.numbers.to_device(device)?, times: self.times.to_device(device)?, added })
    }

    /// Returns a range of frames.
    pub fn part(&self, frames: Range<usize>) -> Result<Self> {
        let part = |tensor: &Tensor| tensor.narrow(1, frames.start, frames.len());
        Ok(Self { numbers: part(&self.numbers)?, times: part(&self.times)?, added: self.added.clone() })
    }
}

/// Embedding table, and the convolution to the width of the last layer.
pub struct WordLayer {
    /// [vocabulary, dim]
    pub table: Tensor,
    pub output: Conv,
}

impl WordLayer {
    /// Creates the tensors for `vocabulary` word indices with embeddings of dimension `dim`.
    pub fn new(params: &mut Params, [vocabulary, dim, width]: [usize; 3]) -> Result<Self> {
        let table = params.trainable(&table_name(WORDS), &[vocabulary, dim], Init::Uniform(INITIAL))?;
        let output = Conv::new(params, &format!("{WORDS}.output"), &[width, dim + N_TIMES, KERNEL], 1)?;
        Ok(Self { table, output })
    }

    /// Appends the vectors of words to encoded audio at the pose rate, [B, T, width]: [B, T, 2 width]. `None`: there is
    /// no word in any frame.
    pub fn forward(&self, encoded: &Tensor, words: Option<&WordFrames>) -> Result<Tensor> {
        let (batch, n_frames, _) = encoded.dims3()?;
        let Some(WordFrames { numbers, times, added }) = words else {
            let none = WordFrames {
                numbers: Tensor::zeros((batch, n_frames), DType::U32, encoded.device())?,
                times: Tensor::zeros((batch, n_frames, N_TIMES), encoded.dtype(), encoded.device())?,
                added: None,
            };
            return self.forward(encoded, Some(&none));
        };
        let table = match added {
            Some(added) => Tensor::cat(&[&self.table, added], 0)?,
            None => self.table.clone(),
        };
        let vectors = table.index_select(&numbers.flatten_all()?, 0)?.reshape((batch, n_frames, table.dim(1)?))?;
        let spoken = Tensor::cat(&[&vectors, times], 2)?;
        Tensor::cat(&[encoded, &self.output.forward(&spoken)?], 2)
    }
}
