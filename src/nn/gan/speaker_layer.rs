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
    pub vectors: Tensor,
    /// [speakers, width, width], multiplied from the right; `None`: the network is of a version that only added
    /// vectors.
    pub weights: Option<Tensor>,
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
