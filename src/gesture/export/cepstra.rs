//! The front end of the sequence networks: from samples to the mel-frequency cepstra of the poses, in float64.

use super::graph::NetworkGraph;
use crate::generate::seq2seq::metadata::SequenceMetadata;
use anyhow::Result;
use orator_base::audio::mfcc::{self, FFT, FULL_SCALE, N_CEPSTRA, PRE_EMPHASIS, STEP_SECS};
use orator_onnx::convert::{AttributeValue, ElementType};
use std::f64::consts::TAU;

/// Front end from `samples` [1, N] to `cepstra` [1, M + context - 1, 26] for M pose frames in complete segments, and the
/// number of pose frames of the sound, `frames` [1].
pub fn front_end(metadata: &SequenceMetadata) -> Result<NetworkGraph> {
    let mut graph = NetworkGraph::new(Default::default());
    let g = &mut graph;
    let n = g.size("samples", 1)?;
    let frames = g.pose_frames(&n, metadata.fps, metadata.rate)?;
    let one = g.graph.ints(&[1])?;
    g.graph.output("frames", "Reshape", &[&frames, &one], &[]);
    let rows = rows(g, &n, metadata.rate)?;
    let means = means(g, &rows, &frames, 1.0 / (metadata.fps.per_sec() * STEP_SECS))?;
    // Silence before and after the sound.
    let silence = g.doubles(&[1, N_CEPSTRA], &mfcc::silence(metadata.rate))?;
    let padded = g.along("Concat", &[&means, &silence], 0);
    let (predicted, context) = (metadata.network.predicted as i64, metadata.network.context as i64);
    let end = g.by("Add", &frames, predicted - 1)?;
    let end = g.by("Div", &end, predicted)?;
    let end = g.by("Mul", &end, predicted)?;
    let end = g.by("Add", &end, context - 1)?;
    let index = g.range(&end)?;
    let at = g.by("Sub", &index, context / 2)?;
    let is_before = g.by("Less", &at, 0)?;
    let at = g.op("Min", &[&at, &frames]);
    let at = g.op("Where", &[&is_before, &frames, &at]);
    let cepstra = g.along("Gather", &[&padded, &at], 0);
    let cepstra = g.cast(&cepstra, ElementType::F32);
    let batch = g.graph.ints(&[0])?;
    g.graph.output("cepstra", "Unsqueeze", &[&cepstra, &batch], &[]);
    Ok(graph)
}

/// Cepstra every 10 ms, [rows, 26], of `n` samples.
fn rows(g: &mut NetworkGraph, n: &str, rate: u32) -> Result<String> {
    let [length, step] = mfcc::window_and_hop(rate);
    let sound = g.shaped("Squeeze", "samples", &[0])?;
    let sound = g.cast(&sound, ElementType::F64);
    let before = g.slice(&sound, 0, [0, -1])?;
    let zero = g.doubles(&[1], &[0.0])?;
    let before = g.along("Concat", &[&zero, &before], 0);
    let emphasis = g.doubles(&[], &[PRE_EMPHASIS])?;
    let before = g.op("Mul", &[&before, &emphasis]);
    let emphasised = g.op("Sub", &[&sound, &before]);
    let scale = g.doubles(&[], &[FULL_SCALE])?;
    let emphasised = g.op("Mul", &[&emphasised, &scale]);
    // Samples after the end are zero.
    let padded = g.along("Concat", &[&emphasised, &zero], 0);
    let last = g.by("Add", n, step as i64 - 1 - length as i64)?;
    let last = g.by("Div", &last, step as i64)?;
    let last = g.by("Max", &last, 0)?;
    let n_rows = g.by("Add", &last, 1)?;
    let starts = g.range(&n_rows)?;
    let starts = g.by("Mul", &starts, step as i64)?;
    let starts = g.shaped("Unsqueeze", &starts, &[1])?;
    let offsets = g.graph.ints(&(0..length as i64).collect::<Vec<_>>())?;
    let at = g.op("Add", &[&starts, &offsets]);
    let at = g.op("Min", &[&at, n]);
    let windows = g.along("Gather", &[&padded, &at], 0);
    cepstra(g, &windows, length, rate)
}

/// Cepstra [rows, 26] of windows [rows, length].
fn cepstra(g: &mut NetworkGraph, windows: &str, length: usize, rate: u32) -> Result<String> {
    let n_bins = FFT / 2 + 1;
    let angle = |i: usize, bin: usize| TAU * ((i * bin) % FFT) as f64 / FFT as f64;
    let mut power: Option<String> = None;
    for part in [f64::cos, f64::sin] {
        let basis = (0..length).flat_map(|i| (0..n_bins).map(move |bin| part(angle(i, bin)) / (FFT as f64).sqrt()));
        let basis = g.doubles(&[length, n_bins], &basis.collect::<Vec<_>>())?;
        let sums = g.op("MatMul", &[windows, &basis]);
        let squares = g.op("Mul", &[&sums, &sums]);
        power = Some(power.map_or(squares.clone(), |power| g.op("Add", &[&power, &squares])));
    }
    let power = power.unwrap_or_default();
    // The bands, and the sum of all bins.
    let bands = mfcc::bands(rate);
    let weights = (0..n_bins).flat_map(|bin| bands.iter().map(move |band| band[bin]).chain([1.0]));
    let weights = g.doubles(&[n_bins, N_CEPSTRA + 1], &weights.collect::<Vec<_>>())?;
    let sums = g.op("MatMul", &[&power, &weights]);
    let [zero, least] = [g.doubles(&[], &[0.0])?, g.doubles(&[], &[f64::EPSILON])?];
    let is_zero = g.op("Equal", &[&sums, &zero]);
    let sums = g.op("Where", &[&is_zero, &least, &sums]);
    let logs = g.op("Log", &[&sums]);
    // Coefficient 0 is the log energy.
    let cosines = mfcc::cosines();
    let weight = |row: usize, c: usize| match (row, c) {
        (N_CEPSTRA, 0) => 1.0,
        (N_CEPSTRA, _) | (_, 0) => 0.0,
        _ => mfcc::lift(c) * cosines[[c, row]],
    };
    let weights = (0..=N_CEPSTRA).flat_map(|row| (0..N_CEPSTRA).map(move |c| weight(row, c)));
    let weights = g.doubles(&[N_CEPSTRA + 1, N_CEPSTRA], &weights.collect::<Vec<_>>())?;
    Ok(g.op("MatMul", &[&logs, &weights]))
}

/// Means [frames, 26] over `per_pose` rows each, where rows at the edges of a pose count partly and the last row is
/// repeated after the end.
fn means(g: &mut NetworkGraph, rows: &str, frames: &str, per_pose: f64) -> Result<String> {
    let n_rows = g.size(rows, 0)?;
    let last = g.by("Sub", &n_rows, 1)?;
    let index = g.range(frames)?;
    let index = g.shaped("Unsqueeze", &index, &[1])?;
    let index = g.cast(&index, ElementType::F64);
    let [per_pose_value, tolerance, one] = [per_pose, 1e-9, 1.0].map(|value| g.doubles(&[], &[value]));
    let (per_pose_value, one) = (per_pose_value?, one?);
    let start = g.op("Mul", &[&index, &per_pose_value]);
    let next = g.op("Add", &[&index, &one]);
    let end = g.op("Mul", &[&next, &per_pose_value]);
    let first = g.op("Add", &[&start, &tolerance?]);
    let first = g.op("Floor", &[&first]);
    let n_read = per_pose.ceil() as usize + 1;
    let offsets = g.doubles(&[n_read], &(0..n_read).map(|k| k as f64).collect::<Vec<_>>())?;
    let from = g.op("Add", &[&first, &offsets]);
    let to = g.op("Add", &[&from, &one]);
    let at = g.cast(&from, ElementType::I64);
    let at = g.op("Min", &[&at, &last]);
    let [to, from] = [g.op("Min", &[&to, &end]), g.op("Max", &[&from, &start])];
    let overlap = g.op("Sub", &[&to, &from]);
    let zero = g.doubles(&[], &[0.0])?;
    let overlap = g.op("Max", &[&overlap, &zero]);
    let weights = g.op("Div", &[&overlap, &per_pose_value]);
    let weights = g.shaped("Unsqueeze", &weights, &[2])?;
    let values = g.along("Gather", &[rows, &at], 0);
    let products = g.op("Mul", &[&values, &weights]);
    let axis = g.graph.ints(&[1])?;
    Ok(g.graph.op("ReduceSum", &[&products, &axis], &[("keepdims", AttributeValue::Int(0))]))
}
