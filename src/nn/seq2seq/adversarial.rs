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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::pattern;
    use candle_core::DType;

    #[test]
    fn the_default_has_the_published_layout() -> Result<()> {
        let mut params = Params::new(1);
        SegmentDiscriminator::new(&mut params, &Config::default())?;
        let weights = params.trainables().filter(|(name, _)| name.ends_with(".weight"));
        let shapes: Vec<(&str, &[usize])> = weights.map(|(name, var)| (name, var.dims())).collect();
        let convolutions: [(&str, &[usize]); 2] = [("conv.0.weight", &[100, 45, 4]), ("conv.1.weight", &[200, 100, 3])];
        let linear: [(&str, &[usize]); 2] = [("linear.0.weight", &[100, 800]), ("linear.1.weight", &[1, 100])];
        let norms: [(&str, &[usize]); 2] = [("norm.0.weight", &[100]), ("norm.1.weight", &[200])];
        assert_eq!(shapes, [convolutions, linear, norms].concat());
        Ok(())
    }

    #[test]
    fn two_to_six_blocks_are_possible_and_all_of_them_are_trained() -> Result<()> {
        for (predicted, n_frames) in [(15, 2), (20, 4)] {
            for n_blocks in 2..=6 {
                let config =
                    Config { pose: 3, predicted, score_channels: [4, 5], score_hidden: 6, ..Config::default() };
                let config = Config { score_blocks: n_blocks, ..config };
                let mut params = Params::with_dtype(1, DType::F64);
                let net = SegmentDiscriminator::new(&mut params, &config)?;
                let logits = net.forward(&pattern(&[4, predicted, 3], 0.0)?, true)?;
                assert_eq!(logits.dims(), [4, 1]);
                assert_eq!(params.tensors()?["linear.0.weight"].dims(), [6, 5 * n_frames]);
                let gradients = logits.sqr()?.sum_all()?.backward()?;
                let is_weight = |name: &str| name.starts_with("conv.") && name.ends_with(".weight");
                let weights: Vec<_> = params.trainables().filter(|(name, _)| is_weight(name)).collect();
                assert_eq!(weights.len(), n_blocks);
                for (i, (name, var)) in weights.into_iter().enumerate() {
                    let n_in = [3, 4, 5][i.min(2)];
                    assert_eq!((name, var.dim(1)?), (format!("conv.{i}.weight").as_str(), n_in));
                    let gradient = gradients.get(var).map(|gradient| gradient.abs()?.max_all()?.to_scalar::<f64>());
                    assert!(gradient.transpose()?.is_some_and(|largest| largest > 1e-9), "{name} of {n_blocks} blocks");
                }
            }
        }
        Ok(())
    }

    #[test]
    fn invalid_numbers_of_blocks_and_poses_are_errors() {
        for (predicted, score_blocks, part) in
            [(20, 0, "0 blocks"), (20, 1, "1 blocks"), (20, 7, "7 blocks"), (7, 2, ": 7")]
        {
            let config = Config { predicted, score_blocks, ..Config::default() };
            let error = SegmentDiscriminator::new(&mut Params::new(1), &config).err().map(|error| error.to_string());
            assert!(error.as_ref().is_some_and(|error| error.contains(part)), "{error:?}");
        }
    }
}
