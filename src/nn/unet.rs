//! The speech-to-gesture generator (Ginosar et al. 2019, as Rebol et al. 2021 use it): log-mel in, poses out. An
//! audio front turns the spectrogram into one vector a pose frame; a UNet over time with additive skips turns those
//! into motion. Fully convolutional: any number of frames that is a multiple of [`FRAMES_MULTIPLE`].

use super::conv_block::{Block1d, Block2d};
use super::conv1d::Conv1d;
use super::params::Params;
use super::resize;
use candle_core::{Result, Tensor};
use serde::{Deserialize, Serialize};

/// The UNet halves time five times.
pub const FRAMES_MULTIPLE: usize = 32;
const N_LEVELS: usize = 5;
const N_DECODER: usize = 4;

/// How the spectrogram is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// For CPUs: mel bands are channels, convolutions run over time only.
    Light,
    /// The published network: convolutions over time and frequency.
    Paper,
}

impl std::str::FromStr for Preset {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match name {
            "light" => Ok(Preset::Light),
            "paper" => Ok(Preset::Paper),
            _ => anyhow::bail!("the network preset is `light` or `paper`, not `{name}`"),
        }
    }
}

/// The network's shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    pub preset: Preset,
    /// Mel bands that come in; 64 for `paper`.
    pub n_mels: usize,
    /// Channels of the UNet.
    pub width: usize,
    /// Numbers of a pose that come out.
    pub n_out: usize,
}

impl Config {
    /// The sizes of a preset: width 256 for `paper`, 128 for `light`.
    pub fn of(preset: Preset, n_out: usize) -> Self {
        let width = if preset == Preset::Paper { 256 } else { 128 };
        Self { preset, n_mels: 64, width, n_out }
    }
}

/// The generator.
pub struct Generator {
    front: Front,
    enter: [Block1d; 2],
    downs: Vec<Block1d>,
    ups: Vec<Block1d>,
    decoder: Vec<Block1d>,
    last: Conv1d,
}

/// Both fronts shorten time by 8 before it is resized to the pose frames.
enum Front {
    Light(Vec<Block1d>),
    Paper(Vec<Block2d>),
}

impl Generator {
    /// Makes the network's tensors.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let n = config.width;
        let front = Front::new(params, config)?;
        let enter = [Block1d::plain(params, "enter.0", n, n)?, Block1d::plain(params, "enter.1", n, n)?];
        let row = |params: &mut Params,
                   name: &str,
                   n_blocks: usize,
                   make: fn(&mut Params, &str, usize, usize) -> Result<Block1d>| {
            (0..n_blocks).map(|i| make(params, &format!("{name}.{i}"), n, n)).collect::<Result<Vec<_>>>()
        };
        let downs = row(params, "down", N_LEVELS, Block1d::down)?;
        let ups = row(params, "up", N_LEVELS, Block1d::plain)?;
        let decoder = row(params, "decoder", N_DECODER, Block1d::plain)?;
        let last = Conv1d::new(params, "last", n, config.n_out, 1)?;
        Ok(Self { front, enter, downs, ups, decoder, last })
    }

    /// `mels` [B, n_mels, T_mel] to poses [B, n_out, n_frames]; `n_frames` is a multiple of [`FRAMES_MULTIPLE`] and
    /// both span the same time.
    pub fn forward(&self, mels: &Tensor, n_frames: usize, train: bool) -> Result<Tensor> {
        if n_frames == 0 || !n_frames.is_multiple_of(FRAMES_MULTIPLE) {
            candle_core::bail!("the generator makes a multiple of {FRAMES_MULTIPLE} frames, not {n_frames}");
        }
        let mut x = resize::linear(&self.front.forward(mels, train)?, n_frames)?;
        for block in &self.enter {
            x = block.forward(&x, train)?;
        }
        let mut skips = Vec::new();
        for block in &self.downs {
            let down = block.forward(&x, train)?;
            skips.push(std::mem::replace(&mut x, down));
        }
        for (block, skip) in self.ups.iter().zip(skips.iter().rev()) {
            x = block.forward(&(resize::twice(&x)? + skip)?, train)?;
        }
        for block in &self.decoder {
            x = block.forward(&x, train)?;
        }
        self.last.forward(&x)
    }
}

impl Front {
    fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let (mels, n) = (config.n_mels, config.width);
        let name = |i: usize| format!("front.{i}");
        Ok(match config.preset {
            Preset::Light => {
                let narrow = n * 3 / 4;
                Front::Light(vec![
                    Block1d::plain(params, &name(0), mels, narrow)?,
                    Block1d::down(params, &name(1), narrow, narrow)?,
                    Block1d::plain(params, &name(2), narrow, n)?,
                    Block1d::down(params, &name(3), n, n)?,
                    Block1d::plain(params, &name(4), n, n)?,
                    Block1d::down(params, &name(5), n, n)?,
                    Block1d::plain(params, &name(6), n, n)?,
                ])
            }
            Preset::Paper => Front::Paper(vec![
                Block2d::plain(params, &name(0), 1, n / 4)?,
                Block2d::down(params, &name(1), n / 4, n / 4)?,
                Block2d::plain(params, &name(2), n / 4, n / 2)?,
                Block2d::down(params, &name(3), n / 2, n / 2)?,
                Block2d::plain(params, &name(4), n / 2, n)?,
                Block2d::down(params, &name(5), n, n)?,
                Block2d::plain(params, &name(6), n, n)?,
                Block2d::valid(params, &name(7), [n, n, 3, mels / 8])?,
            ]),
        })
    }

    /// [B, n_mels, T_mel] to [B, width, T_mel / 8].
    fn forward(&self, mels: &Tensor, train: bool) -> Result<Tensor> {
        match self {
            Front::Light(blocks) => blocks.iter().try_fold(mels.clone(), |x, block| block.forward(&x, train)),
            Front::Paper(blocks) => {
                let image = mels.t()?.unsqueeze(1)?.contiguous()?;
                blocks.iter().try_fold(image, |x, block| block.forward(&x, train))?.squeeze(3)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::finite_difference::{pattern, worst};
    use candle_core::DType;

    fn size(preset: Preset, n_out: usize) -> Result<usize> {
        let mut params = Params::frozen();
        Generator::new(&mut params, &Config::of(preset, n_out))?;
        Ok(params.n_parameters())
    }

    #[test]
    fn sizes_are_the_published_ones() -> Result<()> {
        assert_eq!(size(Preset::Paper, 98)? / 10_000, 742);
        assert_eq!(size(Preset::Paper, 147)? / 10_000, 743);
        assert_eq!(size(Preset::Light, 144)? / 10_000, 121);
        Ok(())
    }

    #[test]
    fn shapes_follow_the_frames_asked_for() -> Result<()> {
        let mut params = Params::new(0);
        let config = Config { preset: Preset::Light, n_mels: 64, width: 16, n_out: 6 };
        let net = Generator::new(&mut params, &config)?;
        for (n_mel, n_frames) in [(418, 64), (427, 64), (213, 32), (1000, 160)] {
            let mels = pattern(&[2, 64, n_mel], 0.0)?.to_dtype(DType::F32)?;
            assert_eq!(net.forward(&mels, n_frames, true)?.dims(), [2, 6, n_frames]);
        }
        let mels = pattern(&[2, 64, 100], 0.0)?.to_dtype(DType::F32)?;
        assert!(net.forward(&mels, 15, false).is_err());
        Ok(())
    }

    #[test]
    fn gradients_reach_the_input_right() -> Result<()> {
        for (preset, n_mels) in [(Preset::Light, 5), (Preset::Paper, 8)] {
            let mut params = Params::with_dtype(1, DType::F64);
            let net = Generator::new(&mut params, &Config { preset, n_mels, width: 4, n_out: 3 })?;
            let mels = pattern(&[2, n_mels, 41], 0.0)?;
            let error = worst(&[mels], |v| net.forward(&v[0], 32, false))?;
            assert!(error < 1e-5, "{preset:?}: {error}");
        }
        Ok(())
    }
}
