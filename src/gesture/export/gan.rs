//! The generator of the GAN, from mels to joints, in one pass: the batch norms are part of the convolutions.

use super::graph::NetworkGraph;
use super::joints::add_joints;
use crate::generate::model::SpeakerMetadata;
use crate::generate::normalisation::N_FEATURES;
use anyhow::Result;
use orator_base::audio::mel::HOP;
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_nn::gan::generator::{Config, EPS, FRAMES_MULTIPLE, Preset, SLOPE};
use orator_nn::gan::speaker_layer::{SPEAKER_EMBEDDING, SPEAKER_WEIGHT};
use orator_nn::gan::words::WORDS;
use orator_nn::seq2seq::encoders::table_name;
use orator_onnx::convert::{AttributeValue, ElementType};

/// Adds the network from `mels` [1, 64, T] (and `words` [1, F], `word_times` [1, F, 2]) to `joints` [F, 49, 3] and, if
/// it was trained on them, `angles` [F, 3 per channel].
pub(super) fn add_generator(g: &NetworkGraph, metadata: &SpeakerMetadata) -> Result<()> {
    let network = &metadata.network;
    let x = interpolated(g, &encoded(g, network)?, &n_frames(g, metadata.fps)?)?;
    let mut x = blocks(g, "enter", x)?;
    let mut skips = Vec::new();
    while g.has_tensor(&format!("down.{}.conv.weight", skips.len())) {
        let down = block(g, &format!("down.{}", skips.len()), &x, 2, true)?;
        skips.push(std::mem::replace(&mut x, down));
    }
    for (level, skip) in skips.iter().rev().enumerate() {
        let once = g.reshaped("Unsqueeze", &x, &[3])?;
        let twice = g.reshaped("Reshape", &g.along("Concat", &[&once, &once], 3), &[1, network.width as i64, -1])?;
        x = block(g, &format!("up.{level}"), &g.op("Add", &[&twice, skip]), 1, true)?;
    }
    x = blocks(g, "decoder", x)?;
    if network.vocabulary > 0 {
        let vectors = g.op("Gather", &[&g.weight(&table_name(WORDS))?, "words"]);
        let spoken = g.transposed(&g.along("Concat", &[&vectors, "word_times"], 2), &[0, 2, 1]);
        x = g.op("Add", &[&x, &layer(g, &format!("{WORDS}.output"), &spoken)?]);
    }
    let features = g.transposed(&g.reshaped("Squeeze", &layer(g, "last", &x)?, &[0])?, &[1, 0]);
    let of_joints = g.slice(&features, 1, [0, N_FEATURES as i64])?;
    add_joints(g, &of_joints, &metadata.representation, &metadata.normalisation)?;
    let channels = &metadata.normalisation.channels;
    if !channels.is_empty() {
        // Angles that were never visible are NaN.
        let std: Vec<f32> = channels.iter().flat_map(|channel| channel.std).collect();
        let mean = channels.iter().flat_map(|channel| channel.mean).zip(&std);
        let mean: Vec<f32> = mean.map(|(mean, std)| if *std == 0.0 { f32::NAN } else { mean }).collect();
        let of_channels = g.slice(&features, 1, [N_FEATURES as i64, 0])?;
        let scaled = g.op("Mul", &[&of_channels, &g.floats(&[std.len()], &std)?]);
        g.output("angles", "Add", &[&scaled, &g.floats(&[mean.len()], &mean)?]);
    }
    Ok(())
}

/// Audio encoder and speaker layer: [1, width, about T / 8].
fn encoded(g: &NetworkGraph, network: &Config) -> Result<String> {
    let is_paper = network.preset == Preset::Paper;
    let mut x = "mels".to_owned();
    if is_paper {
        x = g.reshaped("Unsqueeze", &g.transposed(&x, &[0, 2, 1]), &[1])?;
    }
    for i in 0..7 {
        x = block(g, &format!("front.{i}"), &x, 1 + i % 2, true)?;
    }
    if is_paper {
        x = g.reshaped("Squeeze", &block(g, "front.7", &x, 1, false)?, &[3])?;
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
fn n_frames(g: &NetworkGraph, fps: FrameRate) -> Result<String> {
    let block = FRAMES_MULTIPLE as i64;
    let (per_mel_frame, per_block) =
        (HOP as i64 * i64::from(fps.num), block * i64::from(fps.den) * i64::from(SAMPLE_RATE));
    let steps = [("Mul", 2 * per_mel_frame), ("Add", per_block), ("Div", 2 * per_block), ("Max", 1), ("Mul", block)];
    g.chain(&g.size("mels", 2)?, &steps)
}

/// Linear interpolation over time, in integers as far as possible: frame i of F is at i * T / F.
fn interpolated(g: &NetworkGraph, x: &str, n_frames: &str) -> Result<String> {
    let n = g.size(x, 2)?;
    let at = g.op("Mul", &[&g.range(n_frames)?, &n]);
    let before = g.op("Div", &[&at, n_frames]);
    let rest = g.op("Sub", &[&at, &g.op("Mul", &[&before, n_frames])]);
    let share = g.op("Div", &[&g.cast(&rest, ElementType::F32), &g.cast(n_frames, ElementType::F32)]);
    let after = g.op("Min", &[&g.chain(&before, &[("Add", 1)])?, &g.chain(&n, &[("Sub", 1)])?]);
    let [before, after] = [before, after].map(|at| g.along("Gather", &[x, &at], 2));
    Ok(g.op("Add", &[&before, &g.op("Mul", &[&g.op("Sub", &[&after, &before]), &share])]))
}

/// Convolution with padding, without batch norm.
fn layer(g: &NetworkGraph, name: &str, x: &str) -> Result<String> {
    let ((dims, weight), (_, bias)) = (g.tensor(&format!("{name}.weight"))?, g.tensor(&format!("{name}.bias"))?);
    conv(g, x, (&dims, &weight), &bias, 1, true)
}

/// Blocks `<name>.0`, `<name>.1`, ... that preserve the frame rate.
fn blocks(g: &NetworkGraph, name: &str, x: String) -> Result<String> {
    let mut names =
        (0..).map(|i| format!("{name}.{i}")).take_while(|name| g.has_tensor(&format!("{name}.conv.weight")));
    names.try_fold(x, |x, name| block(g, &name, &x, 1, true))
}

/// Convolution, batch norm and leaky ReLU.
fn block(g: &NetworkGraph, name: &str, x: &str, stride: usize, is_padded: bool) -> Result<String> {
    let of = |part: &str| g.tensor(&format!("{name}.{part}"));
    let ((dims, mut weight), (_, mut bias)) = (of("conv.weight")?, of("conv.bias")?);
    let ((_, gain), (_, shift)) = (of("norm.weight")?, of("norm.bias")?);
    let ((_, mean), (_, variance)) = (of("norm.running_mean")?, of("norm.running_var")?);
    for (channel, weights) in weight.chunks_mut(dims[1..].iter().product()).enumerate() {
        let scale = f64::from(gain[channel]) / (f64::from(variance[channel]) + EPS).sqrt();
        weights.iter_mut().for_each(|weight| *weight = (f64::from(*weight) * scale) as f32);
        let centred = f64::from(bias[channel]) - f64::from(mean[channel]);
        bias[channel] = (centred * scale + f64::from(shift[channel])) as f32;
    }
    let x = conv(g, x, (&dims, &weight), &bias, stride, is_padded)?;
    Ok(g.with("LeakyRelu", &[&x], &[("alpha", AttributeValue::Float(SLOPE as f32))]))
}

/// Convolution over one axis or two. TensorFlow omits the last zero of the padding if it is not read.
fn conv(
    g: &NetworkGraph,
    x: &str,
    (dims, weight): (&[usize], &[f32]),
    bias: &[f32],
    stride: usize,
    is_padded: bool,
) -> Result<String> {
    let before = |kernel: &usize| if is_padded { ((kernel - stride) / 2) as i64 } else { 0 };
    let after = |kernel: &usize| if is_padded { *kernel as i64 - 1 - before(kernel) } else { 0 };
    let kernel = &dims[2..];
    let pads: Vec<i64> = kernel.iter().map(before).chain(kernel.iter().map(after)).collect();
    let strides = vec![stride as i64; kernel.len()];
    let attributes = [("pads", AttributeValue::Ints(&pads)), ("strides", AttributeValue::Ints(&strides))];
    Ok(g.with("Conv", &[x, &g.floats(dims, weight)?, &g.floats(&[bias.len()], bias)?], &attributes))
}
