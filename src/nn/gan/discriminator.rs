//! The motion discriminator: a patch network on the frame-to-frame differences of normalised poses that scores about
//! every fourth frame as real or generated (Ginosar et al. 2019).

use super::generator::{ConvBlock, MOMENTUM, SLOPE};
use crate::gpu::launch::is_on_device;
use crate::gpu::passes::chain;
use crate::ops::conv2d::Conv;
use crate::ops::resize;
use crate::params::Params;
use candle_core::{Result, Tensor};

const KERNEL: usize = 4;
const WIDTH: usize = 64;

/// Network: two layers that halve the frame rate, then two layers at that rate.
pub struct Discriminator {
    first: Conv,
    blocks: [ConvBlock; 2],
    last: Conv,
}

impl Discriminator {
    /// Creates the network's tensors for `n_in` values per pose.
    pub fn new(params: &mut Params, n_in: usize) -> Result<Self> {
        Ok(Self {
            first: Conv::new(params, "first", &[WIDTH, n_in, KERNEL], 2)?,
            blocks: [
                ConvBlock::new(params, "block.0", &[2 * WIDTH, WIDTH, KERNEL], 2, MOMENTUM)?,
                ConvBlock::new(params, "block.1", &[4 * WIDTH, 2 * WIDTH, KERNEL], 1, MOMENTUM)?,
            ],
            last: Conv::new(params, "last", &[1, 4 * WIDTH, KERNEL], 1)?,
        })
    }

    /// Scores differences [B, n_in, T - 1]: [B, 1, about T / 4]; 1 means real, 0 generated.
    pub fn forward(&self, motion: &Tensor, train: bool) -> Result<Tensor> {
        if is_on_device(motion) {
            return self.scores_of_groups(motion, train, 1);
        }
        let mut x = candle_nn::ops::leaky_relu(&self.first.forward(&resize::transposed(motion)?)?, SLOPE)?;
        for block in &self.blocks {
            x = block.forward(&x, train)?;
        }
        resize::transposed(&self.last.forward(&x)?)
    }

    /// [`Self::forward`] on a GPU, of equal parts of a batch as if one after the other.
    pub fn scores_of_groups(&self, motion: &Tensor, train: bool, groups: usize) -> Result<Tensor> {
        let blocks = self.blocks.iter().map(ConvBlock::on_device);
        let layers = std::iter::once(self.first.on_device(SLOPE)).chain(blocks).chain([self.last.on_device(1.0)]);
        chain(layers.collect(), motion, train, groups)
    }
}

/// Returns the differences of successive frames: [B, C, T] to [B, C, T - 1].
pub fn motion(poses: &Tensor) -> Result<Tensor> {
    let n = poses.dim(2)?.saturating_sub(1);
    poses.narrow(2, 1, n)? - poses.narrow(2, 0, n)?
}
