//! Speaker-specific parameters of a network for several speakers: a linear layer between audio encoder and UNet
//! (linear hidden network; Gemello et al. 2007). Encoder and UNet, which model the audio and the arm motion, are
//! shared; the layer models how this speaker responds to the audio.

use crate::params::{Init, Params};
use candle_core::{IndexOp, Result, Tensor};

/// Prefix of the names of all tensors that have one row per speaker.
pub const SPEAKER: &str = "speaker.";
/// Vectors [speakers, width] that are added, and the bound of their initial values, which is as large as the encoded
/// audio, so that the layers distinguish the speakers from the first training step on.
pub const SPEAKER_EMBEDDING: &str = "speaker.embedding";
const EMBEDDING_BOUND: f64 = 1.5;
/// Weights [speakers, width, width] of the layers, minus the identity.
pub const SPEAKER_WEIGHT: &str = "speaker.weight";

/// Layers of all speakers: x + W x + b.
pub struct SpeakerLayer {
    /// [speakers, width]
    vectors: Tensor,
    /// [speakers, width, width], multiplied from the right; `None`: the network is of a version that only added
    /// vectors.
    weights: Option<Tensor>,
}

impl SpeakerLayer {
    /// Creates the tensors; without `has_weights` only the vectors.
    pub fn new(params: &mut Params, n_speakers: usize, width: usize, has_weights: bool) -> Result<Self> {
        let vectors = params.trainable(SPEAKER_EMBEDDING, &[n_speakers, width], Init::Uniform(EMBEDDING_BOUND))?;
        let weights = has_weights
            .then(|| params.trainable(SPEAKER_WEIGHT, &[n_speakers, width, width], Init::Constant(0.0)))
            .transpose()?;
        Ok(Self { vectors, weights })
    }

    /// Applies the layer of each sample's speaker to `encoded` [B, T, width]; `speakers` is ignored by networks for
    /// one speaker.
    pub fn forward(&self, encoded: &Tensor, speakers: &[u32]) -> Result<Tensor> {
        let (n_sounds, n_speakers) = (encoded.dim(0)?, self.vectors.dim(0)?);
        let vectors = of_speakers(&self.vectors, speakers, n_sounds)?;
        let Some(weights) = &self.weights else { return encoded.broadcast_add(&vectors.unsqueeze(1)?) };
        let changed = match n_speakers {
            1 => encoded.broadcast_matmul(&weights.i(0)?)?,
            _ => encoded.matmul(&of_speakers(weights, speakers, n_sounds)?)?,
        };
        (encoded + changed)?.broadcast_add(&vectors.unsqueeze(1)?)
    }
}

/// Returns the rows [`n_sounds`, ...] of the speakers of the samples; [1, ...] for a network for one speaker.
fn of_speakers(table: &Tensor, speakers: &[u32], n_sounds: usize) -> Result<Tensor> {
    let n_speakers = table.dim(0)?;
    if n_speakers == 1 {
        return Ok(table.clone());
    }
    if speakers.len() != n_sounds || speakers.iter().any(|speaker| *speaker as usize >= n_speakers) {
        candle_core::bail!(
            "speakers {speakers:?} of {n_sounds} inputs: expected one index below {n_speakers} for each input"
        );
    }
    table.index_select(&Tensor::new(speakers, table.device())?, 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::{pattern, worst};
    use candle_core::DType;

    #[test]
    fn each_sample_uses_the_layer_of_its_speaker() -> Result<()> {
        let mut params = Params::with_dtype(0, DType::F64);
        let layer = SpeakerLayer::new(&mut params, 3, 4, true)?;
        let encoded = pattern(&[2, 5, 4], 0.0)?;
        let vectors = params.tensors()?[SPEAKER_EMBEDDING].clone();
        let max_difference = |a: Tensor, b: Tensor| (a - b)?.abs()?.flatten_all()?.max(0)?.to_scalar::<f64>();
        // Before the first training step the layers only add the vectors.
        let out = layer.forward(&encoded, &[2, 1])?;
        let expected = encoded.i(0)?.broadcast_add(&vectors.narrow(0, 2, 1)?)?;
        assert!(max_difference(out.i(0)?, expected)? < 1e-12);

        let weights = pattern(&[3, 4, 4], 0.5)?;
        let layer = SpeakerLayer { vectors: vectors.clone(), weights: Some(weights.clone()) };
        let out = layer.forward(&encoded, &[2, 1])?;
        for (sound, speaker) in [(0, 2), (1, 1)] {
            let x = encoded.i(sound)?;
            let expected = (&x + x.matmul(&weights.i(speaker)?)?)?.broadcast_add(&vectors.narrow(0, speaker, 1)?)?;
            assert!(max_difference(out.i(sound)?, expected.clone())? < 1e-12);
            let row = |table: &Tensor| table.narrow(0, speaker, 1);
            let alone = SpeakerLayer { vectors: row(&vectors)?, weights: Some(row(&weights)?) };
            assert!(max_difference(alone.forward(&encoded.narrow(0, sound, 1)?, &[])?.i(0)?, expected)? < 1e-12);
        }
        assert!([&[0][..], &[0, 3], &[]].iter().all(|speakers| layer.forward(&encoded, speakers).is_err()));
        for (n, speakers) in [(3, &[1, 2][..]), (1, &[])] {
            let row = |table: &Tensor| table.narrow(0, 0, n)?.copy();
            let error = worst(&[encoded.clone(), row(&vectors)?, row(&weights)?], |v| {
                SpeakerLayer { vectors: v[1].clone(), weights: Some(v[2].clone()) }.forward(&v[0], speakers)?.sqr()
            })?;
            assert!(error < 1e-7, "{n} speakers: {error}");
        }
        Ok(())
    }
}
