//! The decoder: blocks of causal self-attention with a cache of keys and values, cross-attention to the encoded audio,
//! and feed-forward layers. The embedding of tokens is also the output layer.

use super::config::WhisperConfig;
use super::layers::{CHUNK, FeedForward, LayerNorm, Linear, PackedHead, add};
use super::weight_file::WeightFile;
use super::whisper::{EncodedAudio, Whisper};
use anyhow::{Result, ensure};
use ndarray::Array2;
use orator_nn::cpu::packed_matrix::COLUMNS;
use orator_nn::cpu::spin_pool::{parallel_each, parallel_map};
use orator_nn::cpu::transformer::attend_heads;

pub(super) struct TextDecoder {
    embedding: Linear,
    /// Added to the embedding of each token, [tokens, width].
    positions: Vec<f32>,
    layers: Vec<DecoderLayer>,
    norm: LayerNorm,
    width: usize,
    n_heads: usize,
}

struct DecoderLayer {
    norm: LayerNorm,
    /// Queries, keys and values.
    inputs: Linear,
    output: Linear,
    cross_norm: LayerNorm,
    cross_queries: Linear,
    /// Keys and values.
    cross_inputs: Linear,
    cross_output: Linear,
    feed_forward: FeedForward,
}

/// Keys and values of the tokens of one beam, per layer [tokens, width].
#[derive(Clone)]
pub(super) struct BeamCache {
    layers: Vec<[Vec<f32>; 2]>,
    n_tokens: usize,
}

/// Scores of a head of the cross-attention, [tokens, positions].
pub(super) type HeadScores = ((usize, usize), Vec<f32>);

impl TextDecoder {
    pub(super) fn read(weights: &WeightFile, config: &WhisperConfig) -> Result<Self> {
        let &WhisperConfig { width, n_heads, n_vocab, .. } = config;
        let layer = |i: usize| {
            let name = |part: &str| format!("decoder/layer_{i}/{part}");
            let queries = |part: &str, n_out| Linear::read_queries(weights, &name(part), width, n_out, width / n_heads);
            Ok(DecoderLayer {
                norm: LayerNorm::read(weights, &name("self_attention/layer_norm"), width)?,
                inputs: queries("self_attention/linear_0", 3 * width)?,
                output: Linear::read(weights, &name("self_attention/linear_1"), width, width)?,
                cross_norm: LayerNorm::read(weights, &name("attention/layer_norm"), width)?,
                cross_queries: queries("attention/linear_0", width)?,
                cross_inputs: Linear::read(weights, &name("attention/linear_1"), width, 2 * width)?,
                cross_output: Linear::read(weights, &name("attention/linear_2"), width, width)?,
                feed_forward: FeedForward::read(weights, &name("ffn"), width)?,
            })
        };
        // The largest matrix first, while nothing else is in memory.
        let embedding = weights.tensor("decoder/embeddings/weight", &[n_vocab, width])?;
        Ok(Self {
            embedding: Linear::new(&embedding, vec![0.0; n_vocab]),
            positions: weights.tensor("decoder/position_encodings/encodings", &[config.max_tokens, width])?,
            layers: (0..config.n_decoder_layers).map(layer).collect::<Result<_>>()?,
            norm: LayerNorm::read(weights, "decoder/layer_norm", width)?,
            width,
            n_heads,
        })
    }

    /// Computes keys and values of the cross-attention per layer and head from the output of the encoder.
    pub(super) fn cross_heads(&self, states: &[f32]) -> Vec<Vec<PackedHead>> {
        let (width, dim) = (self.width, self.width / self.n_heads);
        let of_layer = |layer: &DecoderLayer| {
            let mut inputs = vec![0.0; 2 * states.len()];
            parallel_each(states.chunks(CHUNK * width).zip(inputs.chunks_mut(CHUNK * 2 * width)), |_, (x, inputs)| {
                layer.cross_inputs.apply_to(x, width, inputs);
            });
            parallel_map(self.n_heads, |head| PackedHead::new(&inputs, 2 * width, head * dim, width + head * dim, dim))
        };
        self.layers.iter().map(of_layer).collect()
    }

    pub(super) fn empty_cache(&self) -> BeamCache {
        BeamCache { layers: vec![[Vec::new(), Vec::new()]; self.layers.len()], n_tokens: 0 }
    }

    /// Appends tokens to the beams, the same number to each. Returns the states of the new tokens before the output
    /// layer, [beams * tokens, width], and the scores of the heads for which `is_observed` holds.
    pub(super) fn advance(
        &self,
        audio: &EncodedAudio,
        beams: &mut [BeamCache],
        tokens: &[Vec<u32>],
        is_observed: impl Fn((usize, usize)) -> bool + Sync,
    ) -> Result<(Vec<f32>, Vec<HeadScores>)> {
        let (width, n_vocab, max_tokens) = (self.width, self.embedding.n_out(), self.positions.len() / self.width);
        let n_new = tokens.first().map_or(0, Vec::len);
        ensure!(
            tokens.len() == beams.len() && n_new > 0 && tokens.iter().all(|tokens| tokens.len() == n_new),
            "expected tokens for {} beams, the same number for each, at least one",
            beams.len()
        );
        let mut x = Vec::with_capacity(tokens.len() * n_new * width);
        for (beam, tokens) in beams.iter().zip(tokens) {
            ensure!(
                beam.n_tokens + n_new <= max_tokens,
                "{} tokens exceed the maximum of {max_tokens} of the network",
                beam.n_tokens + n_new
            );
            let positions = self.positions[beam.n_tokens * width..].chunks_exact(width);
            for (token, position) in tokens.iter().zip(positions) {
                let token = *token as usize;
                ensure!(token < n_vocab, "the network has no token {token}, expected one below {n_vocab}");
                x.extend(self.embedding.weights_of(token).zip(position).map(|(value, position)| value + position));
            }
        }
        let mut observed = Vec::new();
        for (i, (layer, heads)) in self.layers.iter().zip(&audio.cross_heads).enumerate() {
            let context = self.attend_to_tokens(layer, &x, i, beams, n_new);
            add(&mut x, &layer.output.apply_in_parallel(&context));
            let queries = layer.cross_queries.apply_in_parallel(&layer.cross_norm.apply(&x));
            let (context, scores) = attend_to_audio(heads, &queries, width, |head| is_observed((i, head)));
            observed.extend(scores.into_iter().map(|(head, scores)| ((i, head), scores)));
            add(&mut x, &layer.cross_output.apply_in_parallel(&context));
            layer.feed_forward.add_to(&mut x, Linear::apply_in_parallel);
        }
        beams.iter_mut().for_each(|beam| beam.n_tokens += n_new);
        Ok((x, observed))
    }

    /// Self-attention of the new tokens of all beams, which are appended to the cache of layer `i`.
    fn attend_to_tokens(
        &self,
        layer: &DecoderLayer,
        x: &[f32],
        i: usize,
        beams: &mut [BeamCache],
        n_new: usize,
    ) -> Vec<f32> {
        let width = self.width;
        let inputs = layer.inputs.apply_in_parallel(&layer.norm.apply(x));
        for (beam, inputs) in beams.iter_mut().zip(inputs.chunks_exact(n_new * 3 * width)) {
            let [keys, values] = &mut beam.layers[i];
            for row in inputs.chunks_exact(3 * width) {
                keys.extend_from_slice(&row[width..2 * width]);
                values.extend_from_slice(&row[2 * width..]);
            }
        }
        let mut context = vec![0.0; x.len()];
        let rows = inputs.chunks_exact(3 * width).zip(context.chunks_exact_mut(width));
        parallel_each(rows, |row, (inputs, context)| {
            let beam = &beams[row / n_new];
            let n = beam.n_tokens + row % n_new + 1;
            let [keys, values] = &beam.layers[i];
            let mut scores = vec![0.0; n.next_multiple_of(COLUMNS)];
            attend_heads(
                &inputs[..width],
                &keys[..n * width],
                &values[..n * width],
                self.n_heads,
                &mut scores,
                context,
            );
        });
        context
    }

    /// Logits [rows, vocabulary] of states.
    pub(super) fn logits(&self, states: &[f32]) -> Result<Array2<f32>> {
        let n_vocab = self.embedding.n_out();
        let mut logits = Vec::with_capacity(states.len() / self.width * n_vocab);
        for states in states.chunks(CHUNK * self.width) {
            logits.extend(self.embedding.apply_in_parallel(&self.norm.apply(states)));
        }
        Ok(Array2::from_shape_vec((states.len() / self.width, n_vocab), logits)?)
    }
}

/// Cross-attention of rows of queries [rows, width]. Returns the context, and the scores of the observed heads.
fn attend_to_audio(
    heads: &[PackedHead],
    queries: &[f32],
    width: usize,
    is_observed: impl Fn(usize) -> bool + Sync,
) -> (Vec<f32>, Vec<(usize, Vec<f32>)>) {
    let (n_rows, dim) = (queries.len() / width, width / heads.len());
    let parts = parallel_map(heads.len(), |head| {
        let (mut context, mut scores) = (vec![0.0; n_rows * dim], Vec::new());
        let observed = is_observed(head).then_some(&mut scores);
        heads[head].attend(&queries[head * dim..], &mut context, n_rows, [width, dim], observed);
        (context, scores)
    });
    let mut context = vec![0.0; queries.len()];
    for (row, context) in context.chunks_exact_mut(width).enumerate() {
        for (to, (part, _)) in context.chunks_exact_mut(dim).zip(&parts) {
            to.copy_from_slice(&part[row * dim..][..dim]);
        }
    }
    let scores = parts.into_iter().enumerate().map(|(head, (_, scores))| (head, scores));
    (context, scores.filter(|(head, _)| is_observed(*head)).collect())
}

/// Decoding of one window: the tokens of one or more beams so far.
pub struct TokenDecoder<'a> {
    pub(super) whisper: &'a Whisper,
    pub(super) audio: &'a EncodedAudio,
    pub(super) beams: Vec<BeamCache>,
}

impl TokenDecoder<'_> {
    /// Appends tokens to the beams, the same number to each: the prompt in the first step, one token later. Returns the
    /// logits after the last token, [beams, vocabulary].
    ///
    /// # Errors
    /// The number of beams or tokens is wrong, a token is not in the vocabulary, or there are more than
    /// [`super::WhisperConfig::max_tokens`] tokens.
    pub fn step(&mut self, tokens: &[Vec<u32>]) -> Result<Array2<f32>> {
        let decoder = &self.whisper.decoder;
        let (states, _) = decoder.advance(self.audio, &mut self.beams, tokens, |_| false)?;
        let rows = states.chunks_exact(states.len() / tokens.len());
        let last: Vec<f32> = rows.flat_map(|rows| &rows[rows.len() - decoder.width..]).copied().collect();
        decoder.logits(&last)
    }

    /// Replaces the beams: beam i continues from the former beam `from[i]`. Their number may change.
    ///
    /// # Errors
    /// There is no such beam.
    pub fn reorder(&mut self, from: &[usize]) -> Result<()> {
        let n = self.beams.len();
        ensure!(!from.is_empty() && from.iter().all(|beam| *beam < n), "expected beams below {n}, found {from:?}");
        let mut former: Vec<Option<BeamCache>> = self.beams.drain(..).map(Some).collect();
        for (i, beam) in from.iter().enumerate() {
            let cache = if from[i + 1..].contains(beam) { former[*beam].clone() } else { former[*beam].take() };
            self.beams.extend(cache);
        }
        Ok(())
    }
}
