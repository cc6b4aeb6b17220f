//! The generator of the GAN, from mels to joints, in one pass: the batch norms are part of the convolutions.

use super::graph::NetworkGraph;
use super::joints::add_joints;
use crate::generate::model::SpeakerMetadata;
use crate::generate::normalisation::N_FEATURES;
use anyhow::Result;
use orator_base::audio::mel::HOP;
use orator_base::types::sound::SAMPLE_RATE;
use orator_nn::gan::generator::{Config, EPS, FRAMES_MULTIPLE, Preset, SLOPE};
use orator_nn::gan::speaker_layer::{SPEAKER_EMBEDDING, SPEAKER_WEIGHT};
use orator_nn::gan::words::WORDS;
use orator_nn::seq2seq::encoders::table_name;
use orator_onnx::convert::{AttributeValue, ElementType};

/// Adds the network from `mels` [1, 64, T] (and `words` [1, F], `word_times` [1, F, 2]) to `joints` [F, 49, 3] and, if it
/// was trained on them, `angles` [F, 3 per channel].
pub fn add_generator(g: &mut NetworkGraph, metadata: &SpeakerMetadata) -> Result<()> {
    let network = &metadata.network;
    let encoded = encoded(g, network)?;
    let n_frames = n_frames(g, metadata)?;
    let mut x = interpolated(g, &encoded, &n_frames)?;
    for name in ["enter.0", "enter.1"] {
        x = block(g, name, &x, 1, true)?;
    }
    let mut skips = Vec::new();
    for level in 0.. {
        if g.tensor(&format!("down.{level}.conv.weight")).is_err() {
            break;
        }
        let down = block(g, &format!("down.{level}"), &x, 2, true)?;
        skips.push(std::mem::replace(&mut x, down));
    }
    for (level, skip) in skips.iter().rev().enumerate() {
        let once = g.shaped("Unsqueeze", &x, &[3])?;
        let twice = g.along("Concat", &[&once, &once], 3);
        let doubled = g.shaped("Reshape", &twice, &[1, network.width as i64, -1])?;
        let sum = g.op("Add", &[&doubled, skip]);
        x = block(g, &format!("up.{level}"), &sum, 1, true)?;
    }
    for layer in 0..4 {
        x = block(g, &format!("decoder.{layer}"), &x, 1, true)?;
    }
    if network.vocabulary > 0 {
        let words = words(g)?;
        x = g.op("Add", &[&x, &words]);
    }
    let features = layer(g, "last", &x)?;
    let features = g.shaped("Squeeze", &features, &[0])?;
    let features = g.transposed(&features, &[1, 0]);
    let n_joint_features = N_FEATURES as i64;
    let of_joints = g.slice(&features, 1, [0, n_joint_features])?;
    add_joints(g, &of_joints, &metadata.representation, &metadata.normalisation)?;
    let channels = &metadata.normalisation.channels;
    if !channels.is_empty() {
        let of_channels = g.slice(&features, 1, [n_joint_features, 0])?;
        let std: Vec<f32> = channels.iter().flat_map(|channel| channel.std).collect();
        // Angles that were never visible are NaN.
        let mean = channels.iter().flat_map(|channel| channel.mean).zip(&std);
        let mean: Vec<f32> = mean.map(|(mean, std)| if *std == 0.0 { f32::NAN } else { mean }).collect();
        let [std, mean] = [g.graph.floats(&[std.len()], &std)?, g.graph.floats(&[mean.len()], &mean)?];
        let scaled = g.op("Mul", &[&of_channels, &std]);
        g.graph.output("angles", "Add", &[&scaled, &mean], &[]);
    }
    Ok(())
}

/// Audio encoder and speaker layer: [1, width, about T / 8].
fn encoded(g: &mut NetworkGraph, network: &Config) -> Result<String> {
    let mut x = "mels".to_owned();
    if network.preset == Preset::Paper {
        let time_first = g.transposed(&x, &[0, 2, 1]);
        x = g.shaped("Unsqueeze", &time_first, &[1])?;
    }
    for i in 0..7 {
        x = block(g, &format!("front.{i}"), &x, 1 + i % 2, true)?;
    }
    if network.preset == Preset::Paper {
        x = block(g, "front.7", &x, 1, false)?;
        x = g.shaped("Squeeze", &x, &[3])?;
    }
    if network.n_speakers == 0 {
        return Ok(x);
    }
    let n = network.width;
    let (_, vector) = g.tensor(SPEAKER_EMBEDDING)?;
    let changes = if network.speaker_weights { g.tensor(SPEAKER_WEIGHT)?.1 } else { vec![0.0; n * n] };
    // x + W x + b, where W is multiplied from the right.
    let weight = |i: usize| changes[(i % n) * n + i / n] + f32::from(u8::from(i / n == i % n));
    conv(g, &x, (&[n, n, 1], &(0..n * n).map(weight).collect::<Vec<_>>()), &vector, 1, true)
}

/// Number of pose frames that a spectrogram of T frames covers, rounded to a multiple of 32.
fn n_frames(g: &mut NetworkGraph, metadata: &SpeakerMetadata) -> Result<String> {
    let (multiple, fps) = (FRAMES_MULTIPLE as i64, metadata.fps);
    let n_mel_frames = g.size("mels", 2)?;
    let per_mel_frame = 2 * HOP as i64 * i64::from(fps.num);
    let per_block = multiple * i64::from(fps.den) * i64::from(SAMPLE_RATE);
    let blocks = g.by("Mul", &n_mel_frames, per_mel_frame)?;
    let blocks = g.by("Add", &blocks, per_block)?;
    let blocks = g.by("Div", &blocks, 2 * per_block)?;
    let blocks = g.by("Max", &blocks, 1)?;
    g.by("Mul", &blocks, multiple)
}

/// Linear interpolation over time, in integers as far as possible: frame i of F is at i * T / F.
fn interpolated(g: &mut NetworkGraph, x: &str, n_frames: &str) -> Result<String> {
    let n = g.size(x, 2)?;
    let index = g.range(n_frames)?;
    let at = g.op("Mul", &[&index, &n]);
    let before = g.op("Div", &[&at, n_frames]);
    let rest = g.op("Mul", &[&before, n_frames]);
    let rest = g.op("Sub", &[&at, &rest]);
    let [rest, n_frames] = [rest.as_str(), n_frames].map(|value| g.cast(value, ElementType::F32));
    let share = g.op("Div", &[&rest, &n_frames]);
    let last = g.by("Sub", &n, 1)?;
    let after = g.by("Add", &before, 1)?;
    let after = g.op("Min", &[&after, &last]);
    let [before, after] = [before, after].map(|at| g.along("Gather", &[x, &at], 2));
    let step = g.op("Sub", &[&after, &before]);
    let step = g.op("Mul", &[&step, &share]);
    Ok(g.op("Add", &[&before, &step]))
}

/// Words to the input of the last layer, [1, width, F].
fn words(g: &mut NetworkGraph) -> Result<String> {
    let table = g.weight(&table_name(WORDS))?;
    let vectors = g.op("Gather", &[&table, "words"]);
    let spoken = g.along("Concat", &[&vectors, "word_times"], 2);
    let spoken = g.transposed(&spoken, &[0, 2, 1]);
    layer(g, &format!("{WORDS}.output"), &spoken)
}

/// Convolution with padding, without batch norm.
fn layer(g: &mut NetworkGraph, name: &str, x: &str) -> Result<String> {
    let (dims, weight) = g.tensor(&format!("{name}.weight"))?;
    let (_, bias) = g.tensor(&format!("{name}.bias"))?;
    conv(g, x, (&dims, &weight), &bias, 1, true)
}

/// Convolution, batch norm and leaky ReLU.
fn block(g: &mut NetworkGraph, name: &str, x: &str, stride: usize, is_padded: bool) -> Result<String> {
    let (dims, mut weight) = g.tensor(&format!("{name}.conv.weight"))?;
    let of = |part: &str| g.tensor(&format!("{name}.{part}")).map(|(_, values)| values);
    let (mut bias, gain, shift) = (of("conv.bias")?, of("norm.weight")?, of("norm.bias")?);
    let (mean, variance) = (of("norm.running_mean")?, of("norm.running_var")?);
    let n_inputs = (weight.len() / bias.len().max(1)).max(1);
    for (channel, weights) in weight.chunks_mut(n_inputs).enumerate() {
        let scale = f64::from(gain[channel]) / (f64::from(variance[channel]) + EPS).sqrt();
        weights.iter_mut().for_each(|weight| *weight = (f64::from(*weight) * scale) as f32);
        let centred = f64::from(bias[channel]) - f64::from(mean[channel]);
        bias[channel] = (centred * scale + f64::from(shift[channel])) as f32;
    }
    let x = conv(g, x, (&dims, &weight), &bias, stride, is_padded)?;
    Ok(g.graph.op("LeakyRelu", &[&x], &[("alpha", AttributeValue::Float(SLOPE as f32))]))
}

/// Convolution over one axis or two. A last zero of the padding that TensorFlow would omit is never read.
fn conv(
    g: &mut NetworkGraph,
    x: &str,
    (dims, weight): (&[usize], &[f32]),
    bias: &[f32],
    stride: usize,
    is_padded: bool,
) -> Result<String> {
    let weight = g.graph.floats(dims, weight)?;
    let bias = g.graph.floats(&[bias.len()], bias)?;
    let before = |kernel: &usize| if is_padded { (kernel.saturating_sub(stride) / 2) as i64 } else { 0 };
    let after = |kernel: &usize| if is_padded { *kernel as i64 - 1 - before(kernel) } else { 0 };
    let kernel = &dims[2..];
    let pads: Vec<i64> = kernel.iter().map(before).chain(kernel.iter().map(after)).collect();
    let strides = vec![stride as i64; kernel.len()];
    let attributes = [("pads", AttributeValue::Ints(&pads)), ("strides", AttributeValue::Ints(&strides))];
    Ok(g.graph.op("Conv", &[x, &weight, &bias], &attributes))
}
