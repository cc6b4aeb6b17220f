//! Sizes of the networks, as the authors' code has them by default, and the batch they all read.

use candle_core::{Result, Tensor};
use serde::{Deserialize, Serialize};

/// Sizes and shares of dropout. The default is the code's reading of each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Numbers of a pose.
    pub pose: usize,
    /// Audio features of a frame.
    pub audio: usize,
    /// Audio frames around a pose, odd, its own in the middle.
    pub context: usize,
    /// Poses read before the first that is predicted, and poses predicted at once.
    pub previous: usize,
    pub predicted: usize,
    /// Numbers of every state but those of the words.
    pub hidden: usize,
    /// Words of the training text, and numbers of a word.
    pub vocabulary: usize,
    pub word: usize,
    /// Numbers of a state of the words in one direction.
    pub word_hidden: usize,
    /// Layers of the encoder of `words`; the published network has two, the adversarial one.
    pub encoder_layers: usize,
    /// Whether `words` hears a GRU over the audio around a frame instead of that frame alone.
    pub hears_context: bool,
    /// Share dropped between the layers of the encoder, behind its last, and behind each layer over the context.
    pub dropout_between: f64,
    pub dropout: f64,
    /// Share of state and contexts that `words` drops before the output.
    pub dropout_read: f64,
    /// Channels of the discriminator's convolutions, and numbers of the layer behind them.
    pub score_channels: [usize; 2],
    pub score_hidden: usize,
    /// Numbers of the autoencoder's inner layers, and of the code of a pose.
    pub pose_hidden: usize,
    pub code: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            pose: 45,
            audio: 26,
            context: 61,
            previous: 10,
            predicted: 20,
            hidden: 150,
            vocabulary: 2,
            word: 100,
            word_hidden: 100,
            encoder_layers: 2,
            hears_context: false,
            dropout_between: 0.2,
            dropout: 0.1,
            dropout_read: 0.5,
            score_channels: [100, 200],
            score_hidden: 100,
            pose_hidden: 312,
            code: 40,
        }
    }
}

impl Config {
    /// Audio frames of a segment: those of its poses and half a context on either side.
    pub fn audio_frames(&self) -> usize {
        self.predicted + self.context - 1
    }

    /// Errors when the segment is not one of these sizes.
    pub fn check(&self, segment: &Segment) -> Result<()> {
        let batch = segment.audio.dim(0)?;
        let expected = [batch, self.audio_frames(), self.audio];
        let previous = [batch, self.previous, self.pose];
        if self.context.is_multiple_of(2) || segment.audio.dims() != expected || segment.previous.dims() != previous {
            candle_core::bail!(
                "a segment of audio {:?} and previous poses {:?}, expected {expected:?} and {previous:?} (an odd context)",
                segment.audio.dims(),
                segment.previous.dims()
            );
        }
        Ok(())
    }
}

/// Inputs of a batch of segments.
#[derive(Clone, Debug)]
pub struct Segment {
    /// Audio features [B, predicted + context - 1, audio]: those around the first predicted pose come first.
    pub audio: Tensor,
    /// Poses before the first that is predicted, [B, previous, pose].
    pub previous: Tensor,
    /// Numbers of words in the vocabulary (u32), padded to one length that is at least 1: those of the segment [B, W] for
    /// `words`, those around each predicted pose [B, predicted, W] for `contextual`; none for networks without words.
    pub words: Option<Tensor>,
}

/// Windows of `width` frames around each of the middle frames: [B, T + width - 1, C] to [B, T, width, C].
pub fn windows(audio: &Tensor, width: usize) -> Result<Tensor> {
    let n = (audio.dim(1)? + 1).saturating_sub(width);
    Tensor::stack(&(0..n).map(|t| audio.narrow(1, t, width)).collect::<Result<Vec<_>>>()?, 1)
}
