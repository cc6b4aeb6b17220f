//! The encoder: two convolutions, then blocks of self-attention and feed-forward layers over 1500 positions.

use super::config::WhisperConfig;
use super::layers::{CHUNK, FeedForward, LayerNorm, Linear, PackedHead, add};
use super::weight_file::WeightFile;
use anyhow::Result;
use ndarray::ArrayView2;
use orator_nn::cpu::spin_pool::{parallel_each, parallel_map};
use orator_nn::cpu::transformer::gelu;

pub(super) struct AudioEncoder {
    conv1: Linear,
    conv2: Linear,
    /// Added to the output of the convolutions, [positions, width].
    positions: Vec<f32>,
    layers: Vec<EncoderLayer>,
    norm: LayerNorm,
    width: usize,
}

struct EncoderLayer {
    norm: LayerNorm,
    /// Queries, keys and values.
    inputs: Linear,
    output: Linear,
    feed_forward: FeedForward,
    n_heads: usize,
}

impl AudioEncoder {
    pub(super) fn read(weights: &WeightFile, config: &WhisperConfig) -> Result<Self> {
        let &WhisperConfig { width, n_heads, .. } = config;
        let layer = |i: usize| {
            let name = |part: &str| format!("encoder/layer_{i}/{part}");
            Ok(EncoderLayer {
                norm: LayerNorm::read(weights, &name("self_attention/layer_norm"), width)?,
                inputs: Linear::read_queries(
                    weights,
                    &name("self_attention/linear_0"),
                    width,
                    3 * width,
                    width / n_heads,
                )?,
                output: Linear::read(weights, &name("self_attention/linear_1"), width, width)?,
                feed_forward: FeedForward::read(weights, &name("ffn"), width)?,
                n_heads,
            })
        };
        Ok(Self {
            conv1: Linear::read_conv(weights, "encoder/conv1", config.n_mels, width)?,
            conv2: Linear::read_conv(weights, "encoder/conv2", width, width)?,
            positions: weights.tensor("encoder/position_encodings/encodings", &[config.n_audio_frames, width])?,
            layers: (0..config.n_encoder_layers).map(layer).collect::<Result<_>>()?,
            norm: LayerNorm::read(weights, "encoder/layer_norm", width)?,
            width,
        })
    }

    /// Encodes a spectrogram [bands, 2 * positions]: [positions, width].
    pub(super) fn encode(&self, mel: ArrayView2<f32>) -> Vec<f32> {
        let (n_mels, n_frames) = mel.dim();
        // A zero frame before and after, as the convolutions expect.
        let mut frames = vec![0.0; (n_frames + 2) * n_mels];
        for (frame, column) in frames.chunks_exact_mut(n_mels).skip(1).zip(mel.columns()) {
            frame.iter_mut().zip(column).for_each(|(to, value)| *to = *value);
        }
        let mut hidden = vec![0.0; (n_frames + 2) * self.width];
        convolve(&self.conv1, &frames, n_mels, &mut hidden[self.width..][..n_frames * self.width]);
        let mut x = vec![0.0; self.positions.len()];
        convolve(&self.conv2, &hidden, 2 * self.width, &mut x);
        drop((frames, hidden));
        add(&mut x, &self.positions);
        self.layers.iter().for_each(|layer| layer.apply(&mut x, self.width));
        self.norm.apply(&x)
    }
}

/// Convolution with GELU: row i of `y` depends on three frames of `x` from `i * stride` on.
fn convolve(conv: &Linear, x: &[f32], stride: usize, y: &mut [f32]) {
    parallel_each(y.chunks_mut(CHUNK * conv.n_out()), |i, y| {
        conv.apply_to(&x[i * CHUNK * stride..], stride, y);
        gelu(y);
    });
}

impl EncoderLayer {
    fn apply(&self, x: &mut [f32], width: usize) {
        let (stride, dim) = (3 * width, width / self.n_heads);
        let mut inputs = vec![0.0; 3 * x.len()];
        parallel_each(x.chunks(CHUNK * width).zip(inputs.chunks_mut(CHUNK * stride)), |_, (x, inputs)| {
            self.inputs.apply_to(&self.norm.apply(x), width, inputs);
        });
        let heads = parallel_map(self.n_heads, |head| {
            PackedHead::new(&inputs, stride, width + head * dim, 2 * width + head * dim, dim)
        });
        parallel_each(x.chunks_mut(CHUNK * width).zip(inputs.chunks(CHUNK * stride)), |_, (x, inputs)| {
            let mut context = vec![0.0; x.len()];
            for (head, at) in heads.iter().zip((0..width).step_by(dim)) {
                head.attend(&inputs[at..], &mut context[at..], x.len() / width, [stride, width], None);
            }
            add(x, &self.output.apply(&context));
            self.feed_forward.add_to(x, Linear::apply);
        });
    }
}
