//! Heat-maps of one person's points (Xiao et al. 2018, with the fine levels added on the way up as in Lin et al. 2017):
//! residual convolutions down to a sixteenth of the picture, then up to a quarter.

use super::layers::{ConvLayer, PictureOperators, TensorOperators};
use crate::nn::params::Params;
use crate::types::pose2d::N_BODY;
use candle_core::{Result, Tensor};
use serde::{Deserialize, Serialize};

/// Pixels of the picture to a cell of the heat-maps, along a side.
pub const CELL_PX: usize = 4;

/// Sizes of the network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodyNetConfig {
    /// Height and width of the picture, px, multiples of 16.
    pub size: [usize; 2],
    /// Channels at a half, a quarter, an eighth and a sixteenth of the picture.
    pub widths: [usize; 4],
    /// Residual blocks at each of the last three.
    pub n_blocks: [usize; 3],
}

impl Default for BodyNetConfig {
    fn default() -> Self {
        Self { size: [128, 96], widths: [16, 32, 64, 96], n_blocks: [1, 1, 2] }
    }
}

impl BodyNetConfig {
    /// Rows and columns of a heat-map.
    pub fn cells(&self) -> [usize; 2] {
        self.size.map(|px| px / CELL_PX)
    }
}

/// The network: 0.5 million weights by default.
pub struct BodyNet {
    config: BodyNetConfig,
    stem: ConvLayer,
    /// Levels at a quarter, an eighth and a sixteenth.
    levels: Vec<Level>,
    /// From the coarsest level to the finest.
    ups: Vec<Up>,
    head: ConvLayer,
}

/// Half the size, then residual blocks.
struct Level {
    down: ConvLayer,
    blocks: Vec<[ConvLayer; 2]>,
}

/// To the channels of the next finer level, twice the size, and once more after that level is added.
struct Up {
    across: ConvLayer,
    mixed: ConvLayer,
}

impl BodyNet {
    /// The network's tensors under the names `stem`, `level...`, `up...` and `head`.
    pub fn new(params: &mut Params, config: &BodyNetConfig) -> Result<Self> {
        let [first, widths @ ..] = config.widths;
        let stem = ConvLayer::normed(params, "stem", [first, 3, 3, 3], 2)?;
        let (mut levels, mut ups, mut n_in) = (Vec::new(), Vec::new(), first);
        for (i, (n, n_blocks)) in widths.into_iter().zip(config.n_blocks).enumerate() {
            let down = ConvLayer::normed(params, &format!("level{i}.down"), [n, n_in, 3, 3], 2)?;
            let mut conv =
                |block, k| ConvLayer::normed(params, &format!("level{i}.block{block}.conv{k}"), [n, n, 3, 3], 1);
            let blocks = (0..n_blocks).map(|block| Ok([conv(block, 0)?, conv(block, 1)?])).collect::<Result<_>>()?;
            levels.push(Level { down, blocks });
            n_in = n;
        }
        for i in (1..widths.len()).rev() {
            let (coarse, fine) = (widths[i], widths[i - 1]);
            let across = ConvLayer::normed(params, &format!("up{i}.across"), [fine, coarse, 1, 1], 1)?;
            let mixed = ConvLayer::normed(params, &format!("up{i}.mixed"), [fine, fine, 3, 3], 1)?;
            ups.push(Up { across, mixed });
        }
        let head = ConvLayer::plain(params, "head", [N_BODY, widths[0], 1, 1])?;
        Ok(Self { config: config.clone(), stem, levels, ups, head })
    }

    pub fn config(&self) -> &BodyNetConfig {
        &self.config
    }

    /// Heat-maps from pictures, by any operators.
    pub fn run<O: PictureOperators>(&self, operators: &mut O, pictures: &O::Value) -> Result<O::Value> {
        let mut x = operators.convolution(&self.stem, pictures)?;
        let mut finer = Vec::with_capacity(self.levels.len());
        for level in &self.levels {
            let down = operators.convolution(&level.down, &x)?;
            finer.push(std::mem::replace(&mut x, down));
            for [first, second] in &level.blocks {
                let inner = operators.convolution(first, &x)?;
                let inner = operators.convolution(second, &inner)?;
                x = operators.sum(&x, &inner)?;
            }
        }
        for (up, fine) in self.ups.iter().zip(finer.iter().rev()) {
            let coarse = operators.convolution(&up.across, &x)?;
            let coarse = operators.twice(&coarse)?;
            let both = operators.sum(&coarse, fine)?;
            x = operators.convolution(&up.mixed, &both)?;
        }
        operators.convolution(&self.head, &x)
    }

    /// [B, H, W, 3] to [B, H / 4, W / 4, 17].
    pub fn forward(&self, pictures: &Tensor, train: bool) -> Result<Tensor> {
        self.run(&mut TensorOperators { train }, pictures)
    }

    /// Changes the weight of a new batch in the running statistics.
    pub fn set_momentum(&mut self, momentum: f64) {
        let levels = self.levels.iter_mut().flat_map(|level| {
            let blocks = level.blocks.iter_mut().flatten();
            std::iter::once(&mut level.down).chain(blocks)
        });
        let ups = self.ups.iter_mut().flat_map(|up| [&mut up.across, &mut up.mixed]);
        let all = std::iter::once(&mut self.stem).chain(levels).chain(ups);
        all.for_each(|layer| layer.set_momentum(momentum));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};
    use candle_core::{DType, Device};

    #[test]
    fn the_default_network_is_small_and_gives_a_map_a_point() -> Result<()> {
        let mut params = Params::new(1);
        let net = BodyNet::new(&mut params, &BodyNetConfig::default())?;
        let pictures = Tensor::zeros((2, 128, 96, 3), DType::F32, &Device::Cpu)?;
        assert_eq!(net.forward(&pictures, false)?.dims(), [2, 32, 24, N_BODY]);
        assert!((200_000..700_000).contains(&params.n_parameters()), "{}", params.n_parameters());
        Ok(())
    }

    #[test]
    fn gradients_are_right() -> Result<()> {
        let config = BodyNetConfig { size: [16, 16], widths: [2, 2, 3, 2], n_blocks: [0, 1, 0] };
        let mut params = Params::with_dtype(3, DType::F64);
        let net = BodyNet::new(&mut params, &config)?;
        let pictures = pattern(&[2, 16, 16, 3], 0.0)?;
        net.forward(&pictures, true)?;
        let error = worst(&[pictures], |v| net.forward(&v[0], false))?;
        assert!(error < 1e-6, "{error:e}");
        Ok(())
    }
}
