//! Configuration of the networks, with the defaults of the authors' code, and their common input batch.

use candle_core::{Device, Result, Tensor};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Why the networks run on the CPU only; `None` once all of their operators have a formulation for other devices.
pub const CPU_ONLY: Option<&str> = Some(
    "sequence-to-sequence networks run on the CPU only, since GRU, decoder, linear layers, batch norm and conv1d have \
     no implementation for CUDA",
);
/// Possible numbers of blocks of the discriminator.
pub const SCORE_BLOCKS: RangeInclusive<usize> = 2..=6;

/// Sizes and dropout rates. The defaults are those of the authors' code.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    pub pose: usize,
    /// Number of audio features per frame.
    pub audio: usize,
    /// Number of audio frames around a pose, odd; the pose's own frame is in the middle.
    pub context: usize,
    /// Number of poses before the first predicted one, and number of poses that are predicted at once.
    pub previous: usize,
    pub predicted: usize,
    /// Size of every state except those of the words.
    pub hidden: usize,
    /// Number of words of the vocabulary, and size of a word vector.
    pub vocabulary: usize,
    pub word: usize,
    /// Size of a state of the words in one direction.
    pub word_hidden: usize,
    /// Number of layers of the encoder of `words`: two in the published networks, one in the adversarial one.
    pub encoder_layers: usize,
    /// Whether the encoder of `words` runs a GRU over the audio around a frame instead of using only that frame.
    #[serde(rename = "hears_context")]
    pub audio_context: bool,
    /// Dropout rate between the layers of the encoder; below, after its last layer and each layer over the context.
    pub dropout_between: f64,
    pub dropout: f64,
    /// Dropout rate of state and contexts before the output of `words`.
    pub dropout_read: f64,
    /// Numbers of channels of the discriminator's first two convolutions, and size of the hidden layer after all.
    pub score_channels: [usize; 2],
    pub score_hidden: usize,
    /// Number of blocks of the discriminator, in [`SCORE_BLOCKS`]; those after the second have its number of channels.
    #[serde(default = "two", skip_serializing_if = "is_two")]
    pub score_blocks: usize,
    /// Size of the autoencoder's hidden layers, and of the code of a pose.
    pub pose_hidden: usize,
    pub code: usize,
}

/// Number of blocks in the authors' code.
const fn two() -> usize {
    2
}

fn is_two(n: &usize) -> bool {
    *n == two()
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
            audio_context: false,
            dropout_between: 0.2,
            dropout: 0.1,
            dropout_read: 0.5,
            score_channels: [100, 200],
            score_hidden: 100,
            score_blocks: two(),
            pose_hidden: 312,
            code: 40,
        }
    }
}

impl Config {
    /// Number of audio frames of a segment: those of its poses and half a context on either side.
    pub fn audio_frames(&self) -> usize {
        self.predicted + self.context - 1
    }

    /// Checks the shapes of a segment.
    ///
    /// # Errors
    /// The segment does not have these sizes, or the context is even.
    pub fn check(&self, segment: &Segment) -> Result<()> {
        let batch = segment.audio.dim(0)?;
        let expected = [batch, self.audio_frames(), self.audio];
        let previous = [batch, self.previous, self.pose];
        if self.context.is_multiple_of(2) || segment.audio.dims() != expected || segment.previous.dims() != previous {
            candle_core::bail!(
                "segment has audio {:?}, previous poses {:?}: expected {expected:?}, {previous:?} and an odd context",
                segment.audio.dims(),
                segment.previous.dims()
            );
        }
        Ok(())
    }
}

#[derive(Clone, Debug)]
pub struct Segment {
    /// Audio features [B, predicted + context - 1, audio], starting with the context of the first predicted pose.
    pub audio: Tensor,
    /// Poses before the first predicted one, [B, previous, pose].
    pub previous: Tensor,
    /// Word indices in the vocabulary (u32), padded to a common length of at least 1: those of the segment [B, W] for
    /// `words`, those around each predicted pose [B, predicted, W] for `contextual`; `None` for networks without words.
    pub words: Option<Tensor>,
}

impl Segment {
    /// Copies the segments to a device.
    pub fn on(&self, device: &Device) -> Result<Self> {
        let words = self.words.as_ref().map(|words| words.to_device(device)).transpose()?;
        Ok(Self { audio: self.audio.to_device(device)?, previous: self.previous.to_device(device)?, words })
    }
}

/// Windows of `width` frames around each frame with complete context: [B, T + width - 1, C] to [B, T, width, C].
pub fn windows(audio: &Tensor, width: usize) -> Result<Tensor> {
    let n = (audio.dim(1)? + 1).saturating_sub(width);
    Tensor::stack(&(0..n).map(|t| audio.narrow(1, t, width)).collect::<Result<Vec<_>>>()?, 1)
}
