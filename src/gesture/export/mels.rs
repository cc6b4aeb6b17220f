//! The front end of the GAN: from samples to the log-mel spectrogram of the sound, which is extended by its mirror image
//! as in generation. Computed in float64, since sums over a window are less exact than a fast Fourier transform.

use super::graph::NetworkGraph;
use anyhow::Result;
use orator_base::audio::mel::{self, FFT, FLOOR, HOP, N_MELS, WINDOW};
use orator_base::audio::spectrum::hann;
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_nn::gan::generator::FRAMES_MULTIPLE;
use orator_onnx::convert::ElementType;
use std::f64::consts::TAU;

/// Number of hops in a window, the last one partly.
const PARTS: usize = WINDOW.div_ceil(HOP);

/// Front end from `samples` [1, N] at 16 kHz to `mels` [1, 64, T] and the number of pose frames, `frames` [1].
pub fn front_end(fps: FrameRate) -> Result<NetworkGraph> {
    let mut graph = NetworkGraph::new(Default::default());
    let g = &mut graph;
    let n = g.size("samples", 1)?;
    let frames = g.pose_frames(&n, fps, SAMPLE_RATE)?;
    let one = g.graph.ints(&[1])?;
    g.graph.output("frames", "Reshape", &[&frames, &one], &[]);
    let multiple = FRAMES_MULTIPLE as i64;
    let padded = g.by("Div", &frames, multiple)?;
    let padded = g.by("Add", &padded, 1)?;
    // First sample after the padded frames, rounded to the nearest integer, and the nearest hop.
    let (num, den) = (i64::from(fps.num), i64::from(fps.den));
    let end = g.by("Mul", &padded, multiple * 2 * den * i64::from(SAMPLE_RATE))?;
    let end = g.by("Add", &end, num)?;
    let end = g.by("Div", &end, 2 * num)?;
    let end = g.by("Add", &end, HOP as i64 / 2)?;
    let n_mel_frames = g.by("Div", &end, HOP as i64)?;
    let n_hops = g.by("Add", &n_mel_frames, PARTS as i64 - 1)?;
    let n_extended = g.by("Mul", &n_hops, HOP as i64)?;
    let sound = mirrored(g, &n, &n_extended)?;
    let hops = g.shaped("Reshape", &sound, &[-1, HOP as i64])?;
    let hops = g.cast(&hops, ElementType::F64);
    add_spectrogram(g, &hops)?;
    Ok(graph)
}

/// The sound with `n` samples, extended periodically by its mirror image to `n_extended`.
fn mirrored(g: &mut NetworkGraph, n: &str, n_extended: &str) -> Result<String> {
    let last = g.by("Sub", n, 1)?;
    let period = g.by("Mul", &last, 2)?;
    let period = g.by("Max", &period, 1)?;
    let index = g.range(n_extended)?;
    let index = g.op("Mod", &[&index, &period]);
    let away = g.op("Sub", &[&index, &last]);
    let away = g.op("Abs", &[&away]);
    let at = g.op("Sub", &[&last, &away]);
    Ok(g.along("Gather", &["samples", &at], 1))
}

/// Spectrogram of the windows that begin at each of the `hops` [n, 160] but the last ones.
fn add_spectrogram(g: &mut NetworkGraph, hops: &str) -> Result<()> {
    let bands = mel::all_bands();
    // Bins outside all bands are not computed.
    let first = bands.iter().map(|band| band.first).min().unwrap_or(0);
    let end = bands.iter().map(|band| band.first + band.weights.len()).max().unwrap_or(0);
    let (n_bins, window) = (end - first, hann(WINDOW));
    let mut sums: Option<String> = None;
    for part in 0..PARTS {
        let basis = (part * HOP..(part + 1) * HOP).flat_map(|i| {
            let weight = window.get(i).copied().map_or(0.0, f64::from);
            let angle = move |bin: usize| TAU * ((i * bin) % FFT) as f64 / FFT as f64;
            let cosines = (first..end).map(move |bin| weight * angle(bin).cos());
            cosines.chain((first..end).map(move |bin| weight * angle(bin).sin()))
        });
        let basis = g.doubles(&[HOP, 2 * n_bins], &basis.collect::<Vec<_>>())?;
        let hops = g.slice(hops, 0, [part as i64, part as i64 + 1 - PARTS as i64])?;
        let products = g.op("MatMul", &[&hops, &basis]);
        sums = Some(sums.map_or(products.clone(), |sums| g.op("Add", &[&sums, &products])));
    }
    let sums = sums.unwrap_or_default();
    let squares = g.op("Mul", &[&sums, &sums]);
    let real = g.slice(&squares, 1, [0, n_bins as i64])?;
    let imaginary = g.slice(&squares, 1, [n_bins as i64, 0])?;
    let power = g.op("Add", &[&real, &imaginary]);
    let magnitudes = g.op("Sqrt", &[&power]);
    let mut weights = vec![0.0; n_bins * N_MELS];
    for (column, band) in bands.iter().enumerate() {
        let rows = band.weights.iter().zip(band.first - first..);
        rows.for_each(|(weight, row)| weights[row * N_MELS + column] = f64::from(*weight));
    }
    let weights = g.doubles(&[n_bins, N_MELS], &weights)?;
    let floor = g.doubles(&[], &[f64::from(FLOOR)])?;
    let mels = g.op("MatMul", &[&magnitudes, &weights]);
    let mels = g.op("Add", &[&mels, &floor]);
    let mels = g.op("Log", &[&mels]);
    let mels = g.cast(&mels, ElementType::F32);
    let mels = g.transposed(&mels, &[1, 0]);
    let batch = g.graph.ints(&[0])?;
    g.graph.output("mels", "Unsqueeze", &[&mels, &batch], &[]);
    Ok(())
}
