//! The sequence networks for one segment, unrolled: encoders by the GRU of ONNX, and every step of the decoder. Values are
//! time first, without a batch: [T, C], or [T, 1, C] for a GRU.

use super::graph::NetworkGraph;
use crate::generate::seq2seq::architecture::Architecture;
use crate::generate::seq2seq::metadata::SequenceMetadata;
use anyhow::Result;
use orator_nn::seq2seq::encoders::table_name;
use orator_onnx::convert::AttributeValue;

/// Number added to the variance in the batch norms, as in PyTorch.
const EPS: f64 = 1e-5;

/// Adds the network from the `cepstra` of a segment [1, predicted + context - 1, 26], the `previous` poses
/// [1, previous, C] and, if it reads them, its `words`, to its `poses` [1, predicted, C] and the previous poses of the
/// next segment, `next` [1, previous, C]. `is_carried`: also from the number of the `segment` [1] and the `state` [1, H]
/// of the segment before, which segment 0 ignores, to the `next_state`.
pub fn add_network(g: &mut NetworkGraph, metadata: &SequenceMetadata, is_carried: bool) -> Result<()> {
    let audio = g.shaped("Squeeze", "cepstra", &[0])?;
    let poses = match metadata.architecture {
        Architecture::Autoencoder => autoencoder(g, metadata, &audio)?,
        Architecture::Contextual => {
            let audio = context_encoder(g, "audio_encoder", metadata, &audio)?;
            let last = word_states(g, true)?;
            let words = g.op("Relu", &[&last]);
            let both = g.along("Concat", &[&audio, &words], 1);
            let frames = affine(g, "linear", &both)?;
            let states = both_directions(g, "gru", 0, &frames)?;
            decoder(g, metadata, &[states], is_carried)?
        }
        Architecture::Words => {
            let states = [frame_encoder(g, metadata, &audio)?, word_states(g, false)?];
            decoder(g, metadata, &states, is_carried)?
        }
        Architecture::Audio | Architecture::Adversarial => {
            let states = frame_encoder(g, metadata, &audio)?;
            decoder(g, metadata, &[states], is_carried)?
        }
    };
    let batch = g.graph.ints(&[0])?;
    g.graph.output("poses", "Unsqueeze", &[&poses, &batch], &[]);
    let all = g.along("Concat", &["previous", "poses"], 1);
    let n = -(metadata.network.previous as i64);
    let [start, end, axis] = [n, i64::MAX, 1].map(|integer| g.graph.ints(&[integer]));
    g.graph.output("next", "Slice", &[&all, &start?, &end?, &axis?], &[]);
    Ok(())
}

/// Fully connected layer over the last axis.
fn affine(g: &mut NetworkGraph, name: &str, x: &str) -> Result<String> {
    let weight = g.weight(&format!("{name}.weight"))?;
    let weight = g.transposed(&weight, &[1, 0]);
    let bias = g.weight(&format!("{name}.bias"))?;
    let product = g.op("MatMul", &[x, &weight]);
    Ok(g.op("Add", &[&product, &bias]))
}

/// Layer of a GRU over `x` [T, B, I] from the state `first` [directions, B, H] or zeros, in one direction, or in both if
/// the network has the tensors: all states [T, directions, B, H] and the last ones [directions, B, H].
fn gru(g: &mut NetworkGraph, name: &str, layer: usize, x: &str, first: Option<&str>) -> Result<[String; 2]> {
    let is_bidirectional = g.tensor(&format!("{name}.weight_ih_l{layer}_reverse")).is_ok();
    let suffixes = if is_bidirectional { &["", "_reverse"][..] } else { &[""] };
    let n_directions = suffixes.len();
    let (mut of_input, mut of_state, mut biases, mut sizes) = (Vec::new(), Vec::new(), Vec::new(), [0, 0]);
    for suffix in suffixes {
        let tensor = |kind: &str| g.tensor(&format!("{name}.{kind}_l{layer}{suffix}"));
        let ((shape, input), (_, state)) = (tensor("weight_ih")?, tensor("weight_hh")?);
        sizes = [shape[0] / 3, shape[1]];
        of_input.extend(reordered(&input));
        of_state.extend(reordered(&state));
        biases.extend(reordered(&tensor("bias_ih")?.1));
        biases.extend(reordered(&tensor("bias_hh")?.1));
    }
    let [hidden, n_in] = sizes;
    let of_input = g.graph.floats(&[n_directions, 3 * hidden, n_in], &of_input)?;
    let of_state = g.graph.floats(&[n_directions, 3 * hidden, hidden], &of_state)?;
    let biases = g.graph.floats(&[n_directions, 6 * hidden], &biases)?;
    let mut inputs = vec![x, &of_input, &of_state, &biases];
    inputs.extend(first.map(|first| ["", first]).into_iter().flatten());
    let direction = if is_bidirectional { "bidirectional" } else { "forward" };
    let attributes = [
        ("hidden_size", AttributeValue::Int(hidden as i64)),
        ("direction", AttributeValue::Text(direction)),
        ("linear_before_reset", AttributeValue::Int(1)),
    ];
    let outputs = g.graph.ops(2, "GRU", &inputs, &attributes);
    Ok(std::array::from_fn(|i| outputs[i].clone()))
}

/// Gates in the order of ONNX (update, reset, candidate) from the order reset, update, candidate.
fn reordered(values: &[f32]) -> Vec<f32> {
    let third = values.len() / 3;
    [&values[third..2 * third], &values[..third], &values[2 * third..]].concat()
}

/// States [T, 2 H] of a layer of a GRU in both directions over `x` [T, I].
fn both_directions(g: &mut NetworkGraph, name: &str, layer: usize, x: &str) -> Result<String> {
    let sequence = g.shaped("Unsqueeze", x, &[1])?;
    let [states, _] = gru(g, name, layer, &sequence, None)?;
    let n = 2 * g.tensor(&format!("{name}.bias_ih_l{layer}"))?.0[0] as i64 / 3;
    g.shaped("Reshape", &states, &[-1, n])
}

/// Audio around each pose, [context, predicted, 26].
fn windows(g: &mut NetworkGraph, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let (context, predicted) = (metadata.network.context, metadata.network.predicted);
    let at: Vec<i64> = (0..context).flat_map(|k| (0..predicted).map(move |t| (k + t) as i64)).collect();
    let at = g.graph.ints(&at)?;
    let at = g.shaped("Reshape", &at, &[context as i64, predicted as i64])?;
    Ok(g.along("Gather", &[audio, &at], 0))
}

/// States [predicted, 2 H] of the audio per frame.
fn frame_encoder(g: &mut NetworkGraph, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let (predicted, half) = (metadata.network.predicted as i64, metadata.network.context as i64 / 2);
    let mut x = if metadata.network.audio_context {
        let windows = windows(g, metadata, audio)?;
        let [_, last] = gru(g, "encoder.context", 0, &windows, None)?;
        g.shaped("Squeeze", &last, &[0])?
    } else {
        g.slice(audio, 0, [half, half + predicted])?
    };
    for name in ["encoder.linear.0", "encoder.linear.2"] {
        let sums = affine(g, name, &x)?;
        x = g.op("Relu", &[&sums]);
    }
    let mut layer = 0;
    while g.tensor(&format!("encoder.gru.weight_ih_l{layer}")).is_ok() {
        x = both_directions(g, "encoder.gru", layer, &x)?;
        layer += 1;
    }
    Ok(x)
}

/// Batch norm and ReLU, where the channels are an axis of `dims`.
fn norm(g: &mut NetworkGraph, name: &str, x: &str, dims: &[usize]) -> Result<String> {
    let of = |part: &str| g.tensor(&format!("{name}.{part}")).map(|(_, values)| values);
    let (weight, bias, mean, variance) = (of("weight")?, of("bias")?, of("running_mean")?, of("running_var")?);
    let scale = weight.iter().zip(&variance).map(|(w, v)| f64::from(*w) / (f64::from(*v) + EPS).sqrt());
    let scale: Vec<f64> = scale.collect();
    let shift = bias.iter().zip(&mean).zip(&scale).map(|((b, m), s)| (f64::from(*b) - f64::from(*m) * s) as f32);
    let shift = g.graph.floats(dims, &shift.collect::<Vec<_>>())?;
    let scale = g.graph.floats(dims, &scale.iter().map(|value| *value as f32).collect::<Vec<_>>())?;
    let scaled = g.op("Mul", &[x, &scale]);
    let shifted = g.op("Add", &[&scaled, &shift]);
    Ok(g.op("Relu", &[&shifted]))
}

/// The audio around each pose, [predicted, H].
fn context_encoder(g: &mut NetworkGraph, name: &str, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let (context, hidden) = (metadata.network.context, metadata.network.hidden);
    let mut x = windows(g, metadata, audio)?;
    for layer in 0..3 {
        x = affine(g, &format!("{name}.linear.{layer}"), &x)?;
        x = norm(g, &format!("{name}.norm.{layer}"), &x, &[context, 1, 1])?;
    }
    let [_, last] = gru(g, &format!("{name}.gru"), 0, &x, None)?;
    let last = g.shaped("Squeeze", &last, &[0])?;
    norm(g, &format!("{name}.norm.3"), &last, &[1, hidden])
}

/// Encoded `words`: the states [W, 2 H] of [1, W], or the outputs at the `last` word [predicted, 2 H] of [predicted, W].
fn word_states(g: &mut NetworkGraph, last: bool) -> Result<String> {
    let table = g.weight(&table_name("word_encoder"))?;
    let words = g.transposed("words", &[1, 0]);
    let vectors = g.op("Gather", &[&table, &words]);
    let [states, _] = gru(g, "word_encoder.gru", 0, &vectors, None)?;
    let n = 2 * g.tensor("word_encoder.gru.bias_ih_l0")?.0[0] as i64 / 3;
    if !last {
        return g.shaped("Reshape", &states, &[-1, n]);
    }
    // At the last word the backward direction has read only that word.
    let states = g.slice(&states, 0, [-1, 0])?;
    let states = g.shaped("Squeeze", &states, &[0])?;
    let states = g.transposed(&states, &[1, 0, 2]);
    g.shaped("Reshape", &states, &[-1, n])
}

/// Poses [predicted, C] of the decoder, which attends to `encoded` sequences [K, n], that of the audio first.
fn decoder(g: &mut NetworkGraph, metadata: &SequenceMetadata, encoded: &[String], is_carried: bool) -> Result<String> {
    let (hidden, pose) = (metadata.network.hidden as i64, metadata.network.pose as i64);
    let (end, start) = (g.slice(&encoded[0], 0, [-1, 0])?, g.slice(&encoded[0], 0, [0, 1])?);
    let (end, start) = (g.slice(&end, 1, [0, hidden])?, g.slice(&start, 1, [hidden, 0])?);
    let ends = g.along("Concat", &[&end, &start], 1);
    let first = affine(g, "decoder.init", &ends)?;
    let first = g.shaped("Unsqueeze", &first, &[0])?;
    let previous = g.transposed("previous", &[1, 0, 2]);
    let mut input = g.slice(&previous, 0, [-1, 0])?;
    let [_, mut state] = gru(g, "decoder.gru", 0, &previous, Some(&first))?;
    if is_carried {
        let given = g.shaped("Unsqueeze", "state", &[0])?;
        let [_, carried] = gru(g, "decoder.gru", 0, &input, Some(&given))?;
        let is_first = g.by("Equal", "segment", 0)?;
        state = g.op("Where", &[&is_first, &state, &carried]);
    }
    let names = ["decoder.attention", "decoder.word_attention"];
    let keys = names.iter().zip(encoded).map(|(name, states)| affine(g, name, states)).collect::<Result<Vec<_>>>()?;
    let mut poses = Vec::new();
    for _ in 0..metadata.network.predicted {
        let [_, next] = gru(g, "decoder.gru", 0, &input, Some(&state))?;
        state = next;
        let own = g.shaped("Squeeze", &state, &[0])?;
        let mut read = vec![own.clone()];
        for keys in &keys {
            let columns = g.transposed(keys, &[1, 0]);
            let scores = g.op("MatMul", &[&own, &columns]);
            let weights = g.along("Softmax", &[&scores], 1);
            read.push(g.op("MatMul", &[&weights, keys]));
        }
        let read = g.graph.concat(&read, 1);
        let predicted = affine(g, "decoder.output", &read)?;
        input = g.shaped("Reshape", &predicted, &[1, 1, pose])?;
        poses.push(predicted);
    }
    if is_carried {
        let axis = g.graph.ints(&[0])?;
        g.graph.output("next_state", "Squeeze", &[&state, &axis], &[]);
    }
    Ok(g.graph.concat(&poses, 0))
}

/// Poses [predicted, C] from the codes of the audio.
fn autoencoder(g: &mut NetworkGraph, metadata: &SequenceMetadata, audio: &str) -> Result<String> {
    let encoded = context_encoder(g, "speech.audio_encoder", metadata, audio)?;
    let codes = affine(g, "speech.linear", &encoded)?;
    let sums = affine(g, "autoencoder.decoder.0", &codes)?;
    let wide = g.op("Relu", &[&sums]);
    let sums = affine(g, "autoencoder.decoder.2", &wide)?;
    let scaled = g.op("Tanh", &[&sums]);
    let scale = g.weight("scale")?;
    Ok(g.op("Mul", &[&scaled, &scale]))
}
