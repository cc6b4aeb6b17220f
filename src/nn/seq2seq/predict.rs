//! Common interface of the sequence-to-sequence networks: prediction of a segment of poses, and of a sound by segments.

use super::autoencoder::AudioBaseline;
use super::config::{Config, Segment};
use crate::Mode;
pub use crate::ops::recurrent::decoder::TruePoses;
use candle_core::{Result, Tensor};
use serde::Serialize;

/// A network that predicts poses from previous poses and the speech that accompanies the predicted ones.
pub trait GesturePredictor: Send + Sync {
    fn config(&self) -> &Config;

    /// Predicts the poses [B, predicted, pose] of a batch of segments.
    fn forward(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor>;

    /// Predicts poses as `forward` does, with `truth` as input of the decoder steps for which it is taken. If it is
    /// taken for none, poses and gradients are bitwise those of `forward`.
    ///
    /// # Errors
    /// The sizes do not fit, or the network has no decoder (the default).
    fn forward_with_truth(&self, _segment: &Segment, _truth: &TruePoses, _mode: &mut Mode) -> Result<Tensor> {
        candle_core::bail!("this network has no decoder that reads true poses: train it without scheduled sampling")
    }

    /// The network itself if it is an [`AudioBaseline`], whose pose codes are trained before the speech encoder.
    fn audio_baseline(&self) -> Option<&AudioBaseline> {
        None
    }

    /// Predicts the poses of segments without dropout, from the decoder's `state` after the previous segments if given,
    /// and returns that after these. The default is for networks without a state, which ignore and return none.
    fn continue_from(&self, segment: &Segment, _state: Option<&Tensor>) -> Result<(Tensor, Option<Tensor>)> {
        Ok((self.forward(segment, &mut Mode::Eval)?, None))
    }
}

/// Decoder state at the start of every segment except the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StateAtSeams {
    /// From the encoder, as before the first segment, and updated with the previous poses: as in the authors' code.
    #[default]
    Renewed,
    /// State after the previous segment, as in the paper.
    Carried,
}

/// Generates poses [1, n predicted, pose] for a sound of n segments; each segment starts from the last poses of the
/// one before. Inputs: `audio` [1, n predicted + context - 1, audio] and `start` [1, previous, pose]; `words` returns
/// the words of a segment by its index.
///
/// # Errors
/// The sound is shorter than one segment.
pub fn generate(
    network: &dyn GesturePredictor,
    audio: &Tensor,
    start: &Tensor,
    seams: StateAtSeams,
    mut words: impl FnMut(usize) -> Result<Option<Tensor>>,
) -> Result<Tensor> {
    let config = network.config();
    let n = (audio.dim(1)? + 1).saturating_sub(config.context) / config.predicted;
    let (mut previous, mut state) = (start.clone(), None);
    let mut poses = Vec::with_capacity(n);
    for i in 0..n {
        let audio = audio.narrow(1, i * config.predicted, config.audio_frames())?;
        let segment = Segment { audio, previous: previous.clone(), words: words(i)? };
        let predicted = match seams {
            StateAtSeams::Renewed => network.forward(&segment, &mut Mode::Eval)?,
            StateAtSeams::Carried => {
                let (predicted, state_after) = network.continue_from(&segment, state.as_ref())?;
                state = state_after;
                predicted
            }
        };
        let both = Tensor::cat(&[&previous, &predicted], 1)?;
        previous = both.narrow(1, both.dim(1)? - config.previous, config.previous)?.contiguous()?;
        poses.push(predicted);
    }
    if poses.is_empty() {
        candle_core::bail!("the audio ({} frames) is shorter than one segment", audio.dim(1)?);
    }
    Tensor::cat(&poses, 1)
}
