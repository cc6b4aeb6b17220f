//! The speech-to-gesture generator (Ginosar et al. 2019, as used by Rebol et al. 2021) from log-mel spectrograms to
//! poses. An audio encoder maps the spectrogram to one vector per pose frame; a UNet over time with additive skip
//! connections maps these to motion; words enter before its last layer (`words`). Fully convolutional: any number of
//! frames; the UNet pads them internally. Its convolution blocks are also those of the discriminator.

use super::look_ahead::LookAhead;
use super::speaker_layer::SpeakerLayer;
use super::words::{WordFrames, WordLayer};
use crate::cpu::axis::Padding;
use crate::gpu::launch::is_on_device;
use crate::gpu::layer::DeviceLayer;
use crate::gpu::passes::{self, UnetLayers, chain};
use crate::ops::batch_norm::BatchNorm;
use crate::ops::conv_norm::conv_norm;
use crate::ops::conv2d::{self, Conv};
use crate::ops::resize;
use crate::params::{Init, Params};
use candle_core::{Device, Result, Tensor};
use serde::{Deserialize, Serialize};

/// Divisor of the number of frames inside the UNet, which halves the frame rate five times.
pub const FRAMES_MULTIPLE: usize = 32;
const N_ENTER: usize = 2;
const N_LEVELS: usize = 5;
const N_DECODER: usize = 4;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// For CPUs: mel bands are channels, and convolutions run over time only.
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
            _ => anyhow::bail!("unknown network preset `{name}`: expected `light` or `paper`"),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    pub preset: Preset,
    /// Number of input mel bands; 64 for `paper`.
    pub n_mels: usize,
    /// Number of channels of the UNet.
    pub width: usize,
    /// Number of output values per pose.
    pub n_out: usize,
    /// Weight of a new batch in the running statistics of the batch norms (PyTorch's convention).
    #[serde(default = "default_norm_momentum")]
    pub norm_momentum: f64,
    /// Number of speakers with a layer of their own (`SpeakerLayer`); 0: a network for one speaker, without such a
    /// layer.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub n_speakers: usize,
    /// Whether the speaker layers multiply by weights, or only add vectors, as in earlier versions.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub speaker_weights: bool,
    /// Number of word indices, and dimension of the word embeddings (`WordLayer`); 0: a network without word input.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub vocabulary: usize,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub word: usize,
    /// Limited look-ahead; `None`: the complete network.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_ahead: Option<LookAhead>,
}

fn is_zero(n: &usize) -> bool {
    *n == 0
}

fn default_norm_momentum() -> f64 {
    0.1
}

impl Config {
    /// Creates the configuration of a preset; the UNet is the same for both. The published momentum is 0.01, with
    /// which the running statistics lag behind in trainings of some hundred steps on a CPU, so `light` uses 0.1.
    pub fn from_preset(preset: Preset, n_out: usize) -> Self {
        let norm_momentum = if preset == Preset::Paper { 0.01 } else { 0.1 };
        let (n_speakers, speaker_weights, vocabulary, word) = (0, false, 0, 0);
        let (n_mels, width, look_ahead) = (64, 256, None);
        Self { preset, n_mels, width, n_out, norm_momentum, n_speakers, speaker_weights, vocabulary, word, look_ahead }
    }
}

/// Network from log-mel spectrograms to poses: convolutions that shorten the spectrogram by 8 in time, to one vector
/// per step; then a UNet over time with additive skip connections.
pub struct Generator {
    preset: Preset,
    look_ahead: Option<LookAhead>,
    audio_encoder: Vec<ConvBlock>,
    speakers: Option<SpeakerLayer>,
    words: Option<WordLayer>,
    enter: Vec<ConvBlock>,
    downs: Vec<ConvBlock>,
    ups: Vec<ConvBlock>,
    decoder: Vec<ConvBlock>,
    last: Conv,
}

/// Kernel and stride of a layer that preserves the number of frames, and of one that halves it.
const PLAIN: (usize, usize) = (3, 1);
const DOWN: (usize, usize) = (4, 2);

impl Generator {
    /// Creates the network's tensors.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let (n, momentum) = (config.width, config.norm_momentum);
        let audio_encoder = audio_encoder(params, config)?;
        let speakers = match config.n_speakers {
            0 => None,
            n_speakers => Some(SpeakerLayer::new(params, n_speakers, n, config.speaker_weights)?),
        };
        let words = match config.vocabulary {
            0 => None,
            vocabulary => Some(WordLayer::new(params, [vocabulary, config.word, n])?),
        };
        let padding = if config.look_ahead.is_some() { Padding::Causal } else { Padding::Same };
        let mut row = |name: &str, n_blocks: usize, (kernel, stride): (usize, usize)| {
            let mut block = |i| ConvBlock::new(params, &format!("{name}.{i}"), &[n, n, kernel], stride, momentum);
            (0..n_blocks).map(|i| Ok(ConvBlock { padding, ..block(i)? })).collect::<Result<Vec<_>>>()
        };
        Ok(Self {
            preset: config.preset,
            look_ahead: config.look_ahead,
            audio_encoder,
            speakers,
            words,
            enter: row("enter", N_ENTER, PLAIN)?,
            downs: row("down", N_LEVELS, DOWN)?,
            ups: row("up", N_LEVELS, PLAIN)?,
            decoder: row("decoder", N_DECODER, PLAIN)?,
            last: Conv::new(params, "last", &[config.n_out, n, 1], 1)?,
        })
    }

    pub fn device(&self) -> &Device {
        self.enter.first().map_or(&Device::Cpu, |block| block.weight.device())
    }

    pub fn look_ahead(&self) -> Option<LookAhead> {
        self.look_ahead
    }

    /// Maps `mels` [B, n_mels, T_mel] to poses [B, n_out, n_frames]; `n_frames` is at least 1 and covers the same time as
    /// `mels`. `speakers` as in [`Self::encode`]. A network with word input runs without words.
    pub fn forward(&self, mels: &Tensor, speakers: &[u32], n_frames: usize, train: bool) -> Result<Tensor> {
        self.decode(&self.frames(mels, speakers, None, n_frames, train)?, train)
    }

    /// Encodes `mels` and the words at the pose frames to the input of [`Self::decode`], [B, n_frames, width], or twice
    /// the width with word input; arguments as in [`Self::forward`]. Words are ignored by networks without word input.
    pub fn frames(
        &self,
        mels: &Tensor,
        speakers: &[u32],
        words: Option<&WordFrames>,
        n_frames: usize,
        train: bool,
    ) -> Result<Tensor> {
        if n_frames == 0 {
            candle_core::bail!("no frames: expected at least 1");
        }
        let encoded = self.encode(mels, speakers, train)?;
        let ratio = self.look_ahead.map_or((encoded.dim(1)?, n_frames), |of| of.encoded_per_frame);
        self.with_words(resize::linear_with_ratio(&encoded, n_frames, ratio)?, words)
    }

    /// Appends words to encoded audio at the pose frames, [B, T, width], if there is word input.
    pub fn with_words(&self, encoded: Tensor, words: Option<&WordFrames>) -> Result<Tensor> {
        match &self.words {
            None => Ok(encoded),
            Some(layer) => layer.forward(&encoded, words),
        }
    }

    /// Encodes `mels` [B, n_mels, T_mel] to [B, about T_mel / 8, width]. `speakers` has the index of each sample's
    /// speaker; it is ignored by networks for one speaker.
    pub fn encode(&self, mels: &Tensor, speakers: &[u32], train: bool) -> Result<Tensor> {
        let encoded = match self.preset {
            Preset::Light if is_on_device(mels) => chain(on_device(&self.audio_encoder), mels, train, 1)?.t()?,
            Preset::Paper if is_on_device(mels) => {
                chain(on_device(&self.audio_encoder), &mels.t()?.unsqueeze(1)?, train, 1)?.squeeze(3)?.t()?
            }
            Preset::Light => through(&self.audio_encoder, resize::transposed(mels)?, train)?,
            Preset::Paper => {
                through(&self.audio_encoder, resize::transposed(mels)?.unsqueeze(3)?, train)?.squeeze(2)?
            }
        };
        match &self.speakers {
            None => Ok(encoded),
            Some(layer) => layer.forward(&encoded, speakers),
        }
    }

    /// Decodes vectors at every pose frame, see [`Self::frames`], to poses [B, n_out, T]. If T is not a multiple of
    /// [`FRAMES_MULTIPLE`], zeros follow the audio vectors up to the next one and the poses there are dropped.
    pub fn decode(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        let n_frames = x.dim(1)?;
        let n_padding = n_frames.next_multiple_of(FRAMES_MULTIPLE) - n_frames;
        if n_padding > 0 {
            return self.decode(&x.pad_with_zeros(1, 0, n_padding)?, train)?.narrow(2, 0, n_frames)?.contiguous();
        }
        let (encoded, direct) = match self.words {
            None => (x.clone(), None),
            Some(_) => {
                let width = x.dim(2)? / 2;
                (x.narrow(2, 0, width)?.contiguous()?, Some(x.narrow(2, width, width)?))
            }
        };
        if is_on_device(x) {
            return self.decode_on_device(&encoded.t()?, direct.as_ref(), train);
        }
        let mut x = through(&self.enter, encoded, train)?;
        let mut skips = Vec::new();
        for block in &self.downs {
            let down = block.forward(&x, train)?;
            skips.push(std::mem::replace(&mut x, down));
        }
        for (block, skip) in self.ups.iter().zip(skips.iter().rev()) {
            x = block.forward(&resize::repeat_frames_and_add(&x, skip, self.look_ahead.is_some())?, train)?;
        }
        let x = through(&self.decoder, x, train)?;
        let x = direct.map_or(Ok(x.clone()), |direct| x + direct)?;
        resize::transposed(&self.last.forward(&x)?)
    }

    /// [`Self::decode`] with channels first, [B, width, T] to [B, n_out, T]; `direct` [B, T, width] is added before the
    /// last layer.
    fn decode_on_device(&self, encoded: &Tensor, direct: Option<&Tensor>, train: bool) -> Result<Tensor> {
        let [enter, downs, ups, mut decoder] =
            [&self.enter, &self.downs, &self.ups, &self.decoder].map(|blocks| on_device(blocks));
        let (last, delay) = (self.last.on_device(1.0), usize::from(self.look_ahead.is_some()));
        let Some(direct) = direct else {
            decoder.push(last);
            return passes::unet(UnetLayers { enter, downs, ups, decoder, delay }, encoded, train);
        };
        let decoded = passes::unet(UnetLayers { enter, downs, ups, decoder, delay }, encoded, train)?;
        chain(vec![last], &(decoded + direct.t()?)?, train, 1)
    }
}

fn on_device(blocks: &[ConvBlock]) -> Vec<DeviceLayer> {
    blocks.iter().map(ConvBlock::on_device).collect()
}

fn through(blocks: &[ConvBlock], x: Tensor, train: bool) -> Result<Tensor> {
    blocks.iter().try_fold(x, |x, block| block.forward(&x, train))
}

/// Creates alternating layers that preserve and that halve the frame rate; those of `paper` run over frequency as
/// well, until the last layer combines the remaining frequencies.
fn audio_encoder(params: &mut Params, config: &Config) -> Result<Vec<ConvBlock>> {
    let (mels, n, momentum) = (config.n_mels, config.width, config.norm_momentum);
    let (narrow, wide) = (n * 3 / 8, n / 2);
    let (widths, n_axes) = match config.preset {
        Preset::Light => ([mels, narrow, narrow, wide, wide, wide, n, n], 1),
        Preset::Paper => ([1, n / 4, n / 4, n / 2, n / 2, n, n, n], 2),
    };
    let mut blocks = Vec::new();
    for (i, pair) in widths.windows(2).enumerate() {
        let (kernel, stride) = if i % 2 == 0 { PLAIN } else { DOWN };
        let shape = [&[pair[1], pair[0]], &[kernel; 2][..n_axes]].concat();
        blocks.push(ConvBlock::new(params, &format!("front.{i}"), &shape, stride, momentum)?);
    }
    if config.preset == Preset::Paper {
        blocks.push(ConvBlock::full_height(params, "front.7", [n, n, 3, mels / 8], momentum)?);
    }
    Ok(blocks)
}

/// Number added to the variance in the batch norms.
pub const EPS: f64 = 1e-3;
/// Default weight of a new batch in the running statistics.
pub const MOMENTUM: f64 = 0.1;
/// Negative slope of the leaky ReLU.
pub const SLOPE: f64 = 0.2;

/// Tensors: `<name>.conv.weight` [O, C, K...], `<name>.conv.bias` [O] and the norm `<name>.norm`.
pub struct ConvBlock {
    weight: Tensor,
    bias: Tensor,
    norm: BatchNorm,
    stride: usize,
    /// Without padding, the kernel covers all frequencies.
    padding: Padding,
}

impl ConvBlock {
    /// Creates a block with a weight of this `shape`: [C', C, K] (over time) or [C', C, K, K'] (over time and
    /// frequency). `momentum` is the weight of a new batch in the running statistics.
    pub fn new(params: &mut Params, name: &str, shape: &[usize], stride: usize, momentum: f64) -> Result<Self> {
        let (weight, bias) = params.layer(&format!("{name}.conv"), shape, Init::Glorot, Init::Constant(0.0))?;
        let norm = BatchNorm::new(params, &format!("{name}.norm"), shape[0], EPS, momentum, SLOPE)?;
        Ok(Self { weight, bias, norm, stride, padding: Padding::Same })
    }

    /// Creates a block with a weight of this `shape` [C', C, K, F], stride 1 and no padding, over all F frequencies of
    /// its input.
    pub fn full_height(params: &mut Params, name: &str, shape: [usize; 4], momentum: f64) -> Result<Self> {
        Ok(Self { padding: Padding::None, ..Self::new(params, name, &shape, 1, momentum)? })
    }

    /// Maps [B, T, C] to [B, ceil(T / stride), C'], or [B, T, F, C] to [B, T', F', C'].
    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        if is_on_device(x) {
            return passes::channels_last(self.on_device(), x, train);
        }
        let Self { weight, bias, norm, stride, padding } = self;
        if *padding != Padding::None {
            return conv_norm(x, weight, bias, norm, conv2d::sizes(x, weight, *stride, *padding)?, train);
        }
        // The channels of all frequencies are treated as channels, which leaves a convolution over time.
        let ((batch, time, frequencies, channels), (n_out, _, kernel, _)) = (x.dims4()?, weight.dims4()?);
        let x = x.contiguous()?.reshape((batch, time, frequencies * channels))?;
        let weight = weight.permute((0, 3, 1, 2))?.contiguous()?.reshape((n_out, (), kernel))?;
        conv_norm(&x, &weight, bias, norm, conv2d::sizes(&x, &weight, 1, Padding::None)?, train)?.unsqueeze(2)
    }

    /// Layer for a GPU.
    pub(super) fn on_device(&self) -> DeviceLayer {
        let Self { weight, bias, norm, stride, padding } = self;
        DeviceLayer {
            weight: weight.clone(),
            bias: bias.clone(),
            slope: norm.slope,
            norm: Some(norm.clone()),
            stride: *stride,
            padding: *padding,
        }
    }
}
