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
const KERNEL: usize = 31;

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
    table: Tensor,
    output: Conv,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gan::generator::{Config, Generator, Preset};
    use crate::ops::gradcheck::{pattern, worst};
    use candle_core::Device;

    fn frames() -> Result<WordFrames> {
        let numbers = Tensor::new(&[[0u32, 2, 2, 4, 0], [3, 3, 1, 0, 2]], &Device::Cpu)?;
        Ok(WordFrames { numbers, times: pattern(&[2, 5, N_TIMES], 0.7)?, added: None })
    }

    #[test]
    fn gradients_of_table_and_audio_are_correct() -> Result<()> {
        let inputs = [pattern(&[2, 5, 6], 0.0)?, pattern(&[5, 3], 1.0)?];
        let output = Conv::new(&mut Params::with_dtype(0, DType::F64), "output", &[6, 5, KERNEL], 1)?;
        let error = worst(&inputs, |v| {
            WordLayer { table: v[1].clone(), output: output.clone() }.forward(&v[0], Some(&frames()?))?.sqr()
        })?;
        assert!(error < 1e-7, "{error}");
        Ok(())
    }

    #[test]
    fn added_vectors_follow_those_of_the_table_and_missing_words_are_padding() -> Result<()> {
        let mut params = Params::with_dtype(0, DType::F64);
        let config = Config { width: 8, vocabulary: 4, word: 3, ..Config::from_preset(Preset::Light, 2) };
        let net = Generator::new(&mut params, &config)?;
        let mels = pattern(&[2, 64, 33], 0.0)?;
        let run = |words: Option<&WordFrames>| -> Result<Vec<f64>> {
            net.decode(&net.frames(&mels, &[], words, 5, false)?, false)?.flatten_all()?.to_vec1()
        };
        let words = |added| Ok::<_, candle_core::Error>(WordFrames { added, ..frames()? });
        assert!(run(Some(&words(None)?)).is_err(), "index 4 is after the table");
        let [first, second] = [0.0, 5.0].map(|phase| run(Some(&words(Some(pattern(&[1, 3], phase)?))?)));
        assert_ne!(first?, second?);
        let none = WordFrames {
            numbers: Tensor::zeros((2, 5), DType::U32, &Device::Cpu)?,
            times: Tensor::zeros((2, 5, N_TIMES), DType::F64, &Device::Cpu)?,
            added: None,
        };
        assert_eq!(run(None)?, run(Some(&none))?);
        assert!(run(Some(&none.part(1..3)?)).is_err(), "other number of frames");
        Ok(())
    }
}
