//! The front end of the sequence networks: from samples to the mel-frequency cepstra of the poses, in float64.

use super::graph::NetworkGraph;
use crate::generate::seq2seq::metadata::SequenceMetadata;
use anyhow::Result;
use orator_base::audio::mfcc::{self, FFT, FULL_SCALE, N_CEPSTRA, PRE_EMPHASIS, STEP_SECS};
use orator_onnx::convert::ElementType;
use std::f64::consts::TAU;

/// Front end from `samples` [1, N] to `cepstra` [1, M + context - 1, 26] for M pose frames in complete segments, and
/// the number of pose frames of the sound, `frames` [1].
pub(super) fn front_end(metadata: &SequenceMetadata) -> Result<NetworkGraph> {
    let g = NetworkGraph::new(Default::default());
    let n = g.size("samples", 1)?;
    let frames = g.pose_frames(&n, metadata.fps, metadata.rate)?;
    let rows = rows(&g, &n, metadata.rate)?;
    let means = means(&g, &rows, &frames, 1.0 / (metadata.fps.per_sec() * STEP_SECS))?;
    // Silence before and after the sound.
    let silence = g.doubles(&[1, N_CEPSTRA], mfcc::silence(metadata.rate))?;
    let padded = g.along("Concat", &[&means, &silence], 0);
    let (predicted, context) = (metadata.network.predicted as i64, metadata.network.context as i64);
    let steps = [("Add", predicted - 1), ("Div", predicted), ("Mul", predicted), ("Add", context - 1)];
    let at = g.chain(&g.range(&g.chain(&frames, &steps)?)?, &[("Sub", context / 2)])?;
    let is_before = g.chain(&at, &[("Less", 0)])?;
    let at = g.op("Where", &[&is_before, &frames, &g.op("Min", &[&at, &frames])]);
    let cepstra = g.cast(&g.along("Gather", &[&padded, &at], 0), ElementType::F32);
    g.output("cepstra", "Unsqueeze", &[&cepstra, &g.integers(&[0])?]);
    Ok(g)
}

/// Cepstra every 10 ms, [rows, 26], of `n` samples.
fn rows(g: &NetworkGraph, n: &str, rate: u32) -> Result<String> {
    let [length, step] = mfcc::window_and_hop(rate).map(|n| n as i64);
    let sound = g.cast(&g.reshaped("Squeeze", "samples", &[0])?, ElementType::F64);
    let sound = g.op("Mul", &[&sound, &g.double(FULL_SCALE)?]);
    let zero = g.doubles(&[1], [0.0])?;
    let before = g.along("Concat", &[&zero, &g.slice(&sound, 0, [0, -1])?], 0);
    let emphasised = g.op("Sub", &[&sound, &g.op("Mul", &[&before, &g.double(PRE_EMPHASIS)?])]);
    // Samples after the end are zero.
    let padded = g.along("Concat", &[&emphasised, &zero], 0);
    let n_rows = g.chain(n, &[("Add", step - 1 - length), ("Div", step), ("Max", 0), ("Add", 1)])?;
    let starts = g.reshaped("Unsqueeze", &g.chain(&g.range(&n_rows)?, &[("Mul", step)])?, &[1])?;
    let offsets = g.integers(&(0..length).collect::<Vec<_>>())?;
    let at = g.op("Min", &[&g.op("Add", &[&starts, &offsets]), n]);
    cepstra(g, &g.along("Gather", &[&padded, &at], 0), length as usize, rate)
}

/// Cepstra [rows, 26] of windows [rows, length].
fn cepstra(g: &NetworkGraph, windows: &str, length: usize, rate: u32) -> Result<String> {
    let n_bins = FFT / 2 + 1;
    let mut power: Option<String> = None;
    for wave in [f64::cos, f64::sin] {
        let angle = |i: usize, bin: usize| TAU * ((i * bin) % FFT) as f64 / FFT as f64;
        let basis = (0..length).flat_map(|i| (0..n_bins).map(move |bin| wave(angle(i, bin)) / (FFT as f64).sqrt()));
        let sums = g.op("MatMul", &[windows, &g.doubles(&[length, n_bins], basis)?]);
        let squares = g.op("Mul", &[&sums, &sums]);
        power = Some(power.map_or(squares.clone(), |power| g.op("Add", &[&power, &squares])));
    }
    // The bands, and the sum of all bins.
    let bands = mfcc::bands(rate);
    let weights = (0..n_bins).flat_map(|bin| bands.iter().map(move |band| band[bin]).chain([1.0]));
    let weights = g.doubles(&[n_bins, N_CEPSTRA + 1], weights)?;
    let sums = g.op("MatMul", &[&power.unwrap_or_default(), &weights]);
    let is_zero = g.op("Equal", &[&sums, &g.double(0.0)?]);
    let logs = g.op("Log", &[&g.op("Where", &[&is_zero, &g.double(f64::EPSILON)?, &sums])]);
    // Coefficient 0 is the log energy.
    let cosines = mfcc::cosines();
    let weight = |row: usize, c: usize| match (row, c) {
        (N_CEPSTRA, 0) => 1.0,
        (N_CEPSTRA, _) | (_, 0) => 0.0,
        _ => mfcc::lift(c) * cosines[[c, row]],
    };
    let weights = (0..=N_CEPSTRA).flat_map(|row| (0..N_CEPSTRA).map(move |c| (row, c))).map(|(row, c)| weight(row, c));
    Ok(g.op("MatMul", &[&logs, &g.doubles(&[N_CEPSTRA + 1, N_CEPSTRA], weights)?]))
}

/// Means [frames, 26] over `per_pose` rows each, where rows at the edges of a pose count partly and the last row is
/// repeated after the end.
fn means(g: &NetworkGraph, rows: &str, frames: &str, per_pose: f64) -> Result<String> {
    let index = g.cast(&g.reshaped("Unsqueeze", &g.range(frames)?, &[1])?, ElementType::F64);
    let (one, length) = (g.double(1.0)?, g.double(per_pose)?);
    let start = g.op("Mul", &[&index, &length]);
    let end = g.op("Mul", &[&g.op("Add", &[&index, &one]), &length]);
    let first = g.op("Floor", &[&g.op("Add", &[&start, &g.double(1e-9)?])]);
    let n_read = per_pose.ceil() as usize + 1;
    let from = g.op("Add", &[&first, &g.doubles(&[n_read], (0..n_read).map(|k| k as f64))?]);
    let until = g.op("Min", &[&g.op("Add", &[&from, &one]), &end]);
    let overlap = g.op("Sub", &[&until, &g.op("Max", &[&from, &start])]);
    let weights = g.op("Div", &[&g.op("Max", &[&overlap, &g.double(0.0)?]), &length]);
    let last = g.chain(&g.size(rows, 0)?, &[("Sub", 1)])?;
    let at = g.op("Min", &[&g.cast(&from, ElementType::I64), &last]);
    let values = g.along("Gather", &[rows, &at], 0);
    g.sum(&g.op("Mul", &[&values, &g.reshaped("Unsqueeze", &weights, &[2])?]), 1, false)
}
