//! The discriminator of network C, which classifies a segment of poses as real without audio or words.

use super::config::{Config, SCORE_BLOCKS};
use crate::ops::affine::Affine;
use crate::ops::batch_norm::BatchNorm;
use crate::ops::conv1d::Conv1d;
use crate::params::Params;
use candle_core::{Module, Result, Tensor};

/// Negative slope of the leaky ReLUs.
const SLOPE: f64 = 0.2;

/// Blocks of convolution, batch norm and leaky ReLU, then two linear layers. The first two blocks (kernels 4 and 3)
/// have stride 2; further ones (kernel 3) preserve the number of frames and channels. Tensors: `conv.0`, `norm.0`,
/// `conv.1`, `norm.1` and so on for every block, then `linear.0` and `linear.1`.
pub struct SegmentDiscriminator {
    blocks: Vec<(Conv1d, BatchNorm)>,
    hidden: Affine,
    score: Affine,
}

impl SegmentDiscriminator {
    /// Creates a discriminator for segments of `config.predicted` poses.
    ///
    /// # Errors
    /// The number of blocks is outside [`SCORE_BLOCKS`], or there are too few poses for the first two.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        if !SCORE_BLOCKS.contains(&config.score_blocks) {
            candle_core::bail!("the discriminator has {} blocks, expected {SCORE_BLOCKS:?}", config.score_blocks);
        }
        let [first, second] = config.score_channels;
        let reducing = [(first, 4, Some(2)), (second, 3, Some(2))];
        let layers = reducing.into_iter().chain(std::iter::repeat((second, 3, None))).take(config.score_blocks);
        let (mut blocks, mut n_in, mut n_frames) = (Vec::new(), config.pose, config.predicted);
        for (i, (channels, kernel, stride)) in layers.enumerate() {
            if let Some(stride) = stride {
                if n_frames < kernel {
                    candle_core::bail!("too few poses for the discriminator: {}", config.predicted);
                }
                n_frames = (n_frames - kernel) / stride + 1;
            }
            let conv = Conv1d::with_bias(params, &format!("conv.{i}"), [n_in, channels], kernel, stride)?;
            blocks.push((conv, BatchNorm::new(params, &format!("norm.{i}"), channels, 1e-5, 0.1, SLOPE)?));
            n_in = channels;
        }
        Ok(Self {
            blocks,
            hidden: Affine::new(params, "linear.0", n_in * n_frames, config.score_hidden)?,
            score: Affine::new(params, "linear.1", config.score_hidden, 1)?,
        })
    }

    /// Returns the logits [B, 1] that poses [B, predicted, pose] are real.
    pub fn forward(&self, poses: &Tensor, train: bool) -> Result<Tensor> {
        let mut x = poses.t()?.contiguous()?;
        for (conv, norm) in &self.blocks {
            x = norm.forward(&conv.forward(&x)?, train)?;
        }
        let x = self.hidden.forward(&x.flatten_from(1)?)?;
        self.score.forward(&candle_nn::ops::leaky_relu(&x, SLOPE)?)
    }
}
