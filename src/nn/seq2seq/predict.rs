//! What all sequence-to-sequence networks can do: predict a segment of poses, and a whole sound segment after segment.

use super::autoencoder::AudioBaseline;
use super::config::{Config, Segment};
use crate::nn::Mode;
use candle_core::{Result, Tensor};

/// A network that goes on from poses with the speech that belongs to what follows.
pub trait GesturePredictor: Send + Sync {
    fn config(&self) -> &Config;

    /// Poses [B, predicted, pose] of a batch of segments.
    fn forward(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor>;

    /// Itself where it predicts codes of poses, which are learnt before the speech.
    fn audio_baseline(&self) -> Option<&AudioBaseline> {
        None
    }
}

/// Poses [1, n predicted, pose] of a sound of n segments, each begun with the last poses of the one before; no state but
/// these is carried over, as in the authors' code. `audio` [1, n predicted + context - 1, audio]; `start` [1, previous,
/// pose]; `words` gives those of a segment by its number.
pub fn generate(
    network: &dyn GesturePredictor,
    audio: &Tensor,
    start: &Tensor,
    mut words: impl FnMut(usize) -> Result<Option<Tensor>>,
) -> Result<Tensor> {
    let config = network.config();
    let n = (audio.dim(1)? + 1).saturating_sub(config.context) / config.predicted;
    let mut previous = start.clone();
    let mut poses = Vec::with_capacity(n);
    for i in 0..n {
        let audio = audio.narrow(1, i * config.predicted, config.audio_frames())?;
        let segment = Segment { audio, previous: previous.clone(), words: words(i)? };
        let made = network.forward(&segment, &mut Mode::Eval)?;
        let both = Tensor::cat(&[&previous, &made], 1)?;
        previous = both.narrow(1, both.dim(1)? - config.previous, config.previous)?.contiguous()?;
        poses.push(made);
    }
    if poses.is_empty() {
        candle_core::bail!("a sound of {} frames is shorter than one segment", audio.dim(1)?);
    }
    Tensor::cat(&poses, 1)
}
