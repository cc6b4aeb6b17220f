//! Words as vectors that are trained with the network, and the GRU that reads them.

use crate::ops::recurrent::gru::Gru;
use crate::params::{Init, Params};
use candle_core::{Result, Tensor};

/// `<name>.embedding.weight` [vocabulary, word], first values of variance 1, and the GRU `<name>.gru` in both directions.
pub struct WordEncoder {
    table: Tensor,
    gru: Gru,
}

impl WordEncoder {
    /// `n`: words of the vocabulary, numbers of a word, numbers of a state in one direction.
    pub fn new(params: &mut Params, name: &str, n: [usize; 3]) -> Result<Self> {
        let [vocabulary, word, hidden] = n;
        let table = params.trainable(&table_name(name), &[vocabulary, word], Init::Uniform(3f64.sqrt()))?;
        Ok(Self { table, gru: Gru::new(params, &format!("{name}.gru"), [word, hidden], 0, true)? })
    }

    /// States [B, W, 2 hidden] of words [B, W].
    pub fn states(&self, words: &Tensor) -> Result<Tensor> {
        self.gru.forward(&self.vectors(words)?, 0.0, &mut crate::Mode::Eval)
    }

    /// Output at the last word, [B, 2 hidden]: words before it reach the forward direction alone; padding is read as words
    /// are.
    pub fn last(&self, words: &Tensor) -> Result<Tensor> {
        self.gru.last(&self.vectors(words)?)
    }

    fn vectors(&self, words: &Tensor) -> Result<Tensor> {
        let (batch, n_words) = words.dims2()?;
        let vectors = self.table.index_select(&words.flatten_all()?, 0)?;
        vectors.reshape((batch, n_words, self.table.dim(1)?))
    }
}

/// Name of the table of a word encoder.
fn table_name(encoder: &str) -> String {
    format!("{encoder}.embedding.weight")
}

/// Sets the word vectors [vocabulary, word] of the word encoder `name`. Errors when there is none, or of another shape.
pub fn set_word_vectors(params: &Params, name: &str, vectors: &Tensor) -> Result<()> {
    let table = table_name(name);
    match params.trainables().find(|(own, _)| *own == table) {
        Some((_, var)) => var.set(&vectors.to_dtype(var.dtype())?.to_device(var.device())?),
        None => candle_core::bail!("this network has no tensor {table}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;

    #[test]
    fn vectors_are_set_for_the_encoder_that_is_named_and_for_its_words_alone() -> Result<()> {
        let mut params = Params::new(1);
        let encoder = WordEncoder::new(&mut params, "said", [3, 2, 4])?;
        let states = |word: u32| encoder.last(&Tensor::new(&[[word]], &Device::Cpu)?)?.flatten_all()?.to_vec1::<f32>();
        let before = states(1)?;
        let vectors = Tensor::new(&[[0f64, 0.0], [1.0, 1.0], [0.5, -2.0]], &Device::Cpu)?;
        set_word_vectors(&params, "said", &vectors)?;
        let table = params.trainables().find(|(name, _)| *name == "said.embedding.weight").map(|(_, var)| var);
        assert_eq!(
            table.map(|var| var.to_vec2::<f32>()).transpose()?,
            Some(vec![vec![0.0; 2], vec![1.0; 2], vec![0.5, -2.0]])
        );
        assert!(states(1)? != before && states(1)? != states(2)?);
        for (name, shape) in [("heard", (3, 2)), ("said", (2, 2)), ("said", (3, 3)), ("said", (2, 3))] {
            assert!(set_word_vectors(&params, name, &Tensor::zeros(shape, vectors.dtype(), &Device::Cpu)?).is_err());
        }
        assert!(encoder.last(&Tensor::new(&[[3u32]], &Device::Cpu)?).is_err());
        Ok(())
    }
}
