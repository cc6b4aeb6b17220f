//! The sequence networks for one segment, unrolled: encoders by the GRU of ONNX, and every step of the decoder. Values
//! are time first, without a batch: [T, C], or [T, 1, C] for a GRU.

use super::graph::NetworkGraph;
use crate::generate::seq2seq::architecture::Architecture;
use crate::generate::seq2seq::metadata::SequenceMetadata;
use anyhow::Result;
use orator_nn::seq2seq::encoders::{EPS, table_name};
use orator_onnx::convert::AttributeValue;

/// Adds the network from the `cepstra` of a segment [1, predicted + context - 1, 26], the `previous` poses
/// [1, previous, C] and, if it reads them, its `words`, to its `poses` [1, predicted, C] and the previous poses of the
/// next segment, `next` [1, previous, C]. `is_carried`: also from the number of the `segment` [1] and the `state`
/// [1, H] of the segment before, which segment 0 ignores, to the `next_state`.
pub(super) fn add_network(g: &NetworkGraph, metadata: &SequenceMetadata, is_carried: bool) -> Result<()> {
    let audio = g.reshaped("Squeeze", "cepstra", &[0])?;
    let poses = match metadata.architecture {
        Architecture::Autoencoder => autoencoder(g, metadata, &audio)?,
        Architecture::Contextual => {
            let audio = context_encoder(g, "audio_encoder", metadata, &audio)?;
            let both = g.along("Concat", &[&audio, &g.op("Relu", &[&word_states(g, true)?])], 1);
            let states = both_directions(g, "gru", 0, &affine(g, "linear", &both)?)?;
            decoder(g, metadata, &[states], is_carried)?
        }
        Architecture::Words => {
            let states = [frame_encoder(g, metadata, &audio)?, word_states(g, false)?];
            decoder(g, metadata, &states, is_carried)?
        }
        Architecture::Audio | Architecture::Adversarial => {
            decoder(g, metadata, &[frame_encoder(g, metadata, &audio)?], is_carried)?
        }
    };
    g.output("poses", "Unsqueeze", &[&poses, &g.integers(&[0])?]);
    let all = g.along("Concat", &["previous", "poses"], 1);
    let [start, end, axis] = [-(metadata.network.previous as i64), i64::MAX, 1].map(|number| g.integers(&[number]));
    g.output("next", "Slice", &[&all, &start?, &end?, &axis?]);
    Ok(())
}

/// Fully connected layer over the last axis.
fn affine(g: &NetworkGraph, name: &str, x: &str) -> Result<String> {
    let weight = g.transposed(&g.weight(&format!("{name}.weight"))?, &[1, 0]);
    Ok(g.op("Add", &[&g.op("MatMul", &[x, &weight]), &g.weight(&format!("{name}.bias"))?]))
}

/// Layer of a GRU over `x` [T, B, I] from the state `first` [directions, B, H] or zeros, in one direction, or in both
/// if the network has the tensors: all states [T, directions, B, H] and the last ones [directions, B, H].
fn gru(g: &NetworkGraph, name: &str, layer: usize, x: &str, first: Option<&str>) -> Result<[String; 2]> {
    let is_bidirectional = g.has_tensor(&format!("{name}.weight_ih_l{layer}_reverse"));
    let (n, hidden) = (1 + usize::from(is_bidirectional), n_states(g, name, layer)?);
    // Gates in the order update, reset, candidate.
    let part = |kind: &str, suffix: &str| {
        let (_, values) = g.tensor(&format!("{name}.{kind}_l{layer}{suffix}"))?;
        let third = values.len() / 3;
        Ok([&values[third..2 * third], &values[..third], &values[2 * third..]].concat())
    };
    let parts = |kinds: &str| -> Result<Vec<f32>> {
        let names = ["", "_reverse"][..n].iter().flat_map(|suffix| kinds.split(' ').map(move |kind| (kind, suffix)));
        Ok(names.map(|(kind, suffix)| part(kind, suffix)).collect::<Result<Vec<_>>>()?.concat())
    };
    let (of_input, of_state) = (parts("weight_ih")?, parts("weight_hh")?);
    let of_input = g.floats(&[n, 3 * hidden, of_input.len() / (3 * hidden * n)], &of_input)?;
    let of_state = g.floats(&[n, 3 * hidden, hidden], &of_state)?;
    let biases = g.floats(&[n, 6 * hidden], &parts("bias_ih bias_hh")?)?;
    let mut inputs = vec![x, &of_input, &of_state, &biases];
    inputs.extend(first.map(|first| ["", first]).into_iter().flatten());
    let attributes = [
        ("hidden_size", AttributeValue::Int(hidden as i64)),
        ("direction", AttributeValue::Text(if is_bidirectional { "bidirectional" } else { "forward" })),
        ("linear_before_reset", AttributeValue::Int(1)),
    ];
    Ok(g.pair("GRU", &inputs, &attributes))
}

/// Size of the state of a layer of a GRU in one direction.
fn n_states(g: &NetworkGraph, name: &str, layer: usize) -> Result<usize> {
    Ok(g.tensor(&format!("{name}.bias_ih_l{layer}"))?.1.len() / 3)
}

/// States [T, 2 H] of a layer of a GRU in both directions over `x` [T, I].
fn both_directions(g: &NetworkGraph, name: &str, layer: usize, x: &str) -> Result<String> {
    let [states, _] = gru(g, name, layer, &g.reshaped("Unsqueeze", x, &[1])?, None)?;
    g.reshaped("Reshape", &states, &[-1, 2 * n_states(g, name, layer)? as i64])
}

/// Last state [B, H] of a GRU over `x` [T, B, I] in one direction.
fn last_state(g: &NetworkGraph, name: &str, x: &str) -> Result<String> {
    let [_, last] = gru(g, name, 0, x, None)?;
    g.reshaped("Squeeze", &last, &[0])
}

/// Audio around each pose, [context, predicted, 26].
fn windows(g: &NetworkGraph, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let (context, predicted) = (metadata.network.context as i64, metadata.network.predicted as i64);
    let at: Vec<i64> = (0..context).flat_map(|k| (0..predicted).map(move |t| k + t)).collect();
    let at = g.reshaped("Reshape", &g.integers(&at)?, &[context, predicted])?;
    Ok(g.op("Gather", &[audio, &at]))
}

/// States [predicted, 2 H] of the audio per frame.
fn frame_encoder(g: &NetworkGraph, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let (predicted, half) = (metadata.network.predicted as i64, metadata.network.context as i64 / 2);
    let mut x = if metadata.network.audio_context {
        last_state(g, "encoder.context", &windows(g, metadata, audio)?)?
    } else {
        g.slice(audio, 0, [half, half + predicted])?
    };
    for name in ["encoder.linear.0", "encoder.linear.2"] {
        x = g.op("Relu", &[&affine(g, name, &x)?]);
    }
    let mut layers = (0..).take_while(|layer| g.has_tensor(&format!("encoder.gru.weight_ih_l{layer}")));
    layers.try_fold(x, |x, layer| both_directions(g, "encoder.gru", layer, &x))
}

/// Batch norm and ReLU, where the channels are an axis of `dims`.
fn norm(g: &NetworkGraph, name: &str, x: &str, dims: &[usize]) -> Result<String> {
    let of = |part: &str| g.tensor(&format!("{name}.{part}")).map(|(_, values)| values);
    let (weight, bias, mean, variance) = (of("weight")?, of("bias")?, of("running_mean")?, of("running_var")?);
    let scale = |i: usize| f64::from(weight[i]) / (f64::from(variance[i]) + EPS).sqrt();
    let shift = |i: usize| (f64::from(bias[i]) - f64::from(mean[i]) * scale(i)) as f32;
    let shift = g.floats(dims, &(0..weight.len()).map(shift).collect::<Vec<_>>())?;
    let scale = g.floats(dims, &(0..weight.len()).map(|i| scale(i) as f32).collect::<Vec<_>>())?;
    Ok(g.op("Relu", &[&g.op("Add", &[&g.op("Mul", &[x, &scale]), &shift])]))
}

/// The audio around each pose, [predicted, H].
fn context_encoder(g: &NetworkGraph, name: &str, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let (context, hidden) = (metadata.network.context, metadata.network.hidden);
    let mut x = windows(g, metadata, audio)?;
    for layer in 0..3 {
        x = affine(g, &format!("{name}.linear.{layer}"), &x)?;
        x = norm(g, &format!("{name}.norm.{layer}"), &x, &[context, 1, 1])?;
    }
    norm(g, &format!("{name}.norm.3"), &last_state(g, &format!("{name}.gru"), &x)?, &[1, hidden])
}

/// Encoded `words`: the states [W, 2 H] of [1, W], or the outputs at the last word [predicted, 2 H] of [predicted, W].
fn word_states(g: &NetworkGraph, is_last: bool) -> Result<String> {
    let vectors = g.op("Gather", &[&g.weight(&table_name("word_encoder"))?, &g.transposed("words", &[1, 0])]);
    let [mut states, _] = gru(g, "word_encoder.gru", 0, &vectors, None)?;
    if is_last {
        // At the last word the backward direction has read only that word.
        let last = g.reshaped("Squeeze", &g.slice(&states, 0, [-1, 0])?, &[0])?;
        states = g.transposed(&last, &[1, 0, 2]);
    }
    g.reshaped("Reshape", &states, &[-1, 2 * n_states(g, "word_encoder.gru", 0)? as i64])
}

/// Poses [predicted, C] of the decoder, which attends to `encoded` sequences [K, n], that of the audio first.
fn decoder(g: &NetworkGraph, metadata: &SequenceMetadata, encoded: &[String], is_carried: bool) -> Result<String> {
    let (hidden, pose) = (metadata.network.hidden as i64, metadata.network.pose as i64);
    let end = g.slice(&g.slice(&encoded[0], 0, [-1, 0])?, 1, [0, hidden])?;
    let beginning = g.slice(&g.slice(&encoded[0], 0, [0, 1])?, 1, [hidden, 0])?;
    let first = affine(g, "decoder.init", &g.along("Concat", &[&end, &beginning], 1))?;
    let previous = g.transposed("previous", &[1, 0, 2]);
    let mut input = g.slice(&previous, 0, [-1, 0])?;
    let [_, mut state] = gru(g, "decoder.gru", 0, &previous, Some(&g.reshaped("Unsqueeze", &first, &[0])?))?;
    if is_carried {
        let [_, carried] = gru(g, "decoder.gru", 0, &input, Some(&g.reshaped("Unsqueeze", "state", &[0])?))?;
        state = g.op("Where", &[&g.chain("segment_index", &[("Equal", 0)])?, &state, &carried]);
    }
    let names = ["decoder.attention", "decoder.word_attention"];
    let keys = names.iter().zip(encoded).map(|(name, states)| affine(g, name, states)).collect::<Result<Vec<_>>>()?;
    let mut poses = Vec::new();
    for _ in 0..metadata.network.predicted {
        [_, state] = gru(g, "decoder.gru", 0, &input, Some(&state))?;
        let own = g.reshaped("Squeeze", &state, &[0])?;
        let mut read = own.clone();
        for keys in &keys {
            let scores = g.op("MatMul", &[&own, &g.transposed(keys, &[1, 0])]);
            let context = g.op("MatMul", &[&g.along("Softmax", &[&scores], 1), keys]);
            read = g.along("Concat", &[&read, &context], 1);
        }
        let predicted = affine(g, "decoder.output", &read)?;
        input = g.reshaped("Reshape", &predicted, &[1, 1, pose])?;
        poses.push(predicted);
    }
    if is_carried {
        g.output("next_state", "Squeeze", &[&state, &g.integers(&[0])?]);
    }
    Ok(g.along("Concat", &poses.iter().map(String::as_str).collect::<Vec<_>>(), 0))
}

/// Poses [predicted, C] from the codes of the audio.
fn autoencoder(g: &NetworkGraph, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let encoded = context_encoder(g, "speech.audio_encoder", metadata, audio)?;
    let codes = affine(g, "speech.linear", &encoded)?;
    let wide = g.op("Relu", &[&affine(g, "autoencoder.decoder.0", &codes)?]);
    let scaled = g.op("Tanh", &[&affine(g, "autoencoder.decoder.2", &wide)?]);
    Ok(g.op("Mul", &[&scaled, &g.weight("scale")?]))
}
