//! The front end of the GAN: from samples to the log-mel spectrogram of the sound, extended by its mirror image as in
//! generation. Computed in float64, since sums over a window are less exact than a fast Fourier transform.

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
pub(super) fn front_end(fps: FrameRate) -> Result<NetworkGraph> {
    let g = NetworkGraph::new(Default::default());
    let n = g.size("samples", 1)?;
    let frames = g.pose_frames(&n, fps, SAMPLE_RATE)?;
    let (num, den, hop, block) = (i64::from(fps.num), i64::from(fps.den), HOP as i64, FRAMES_MULTIPLE as i64);
    let blocks = g.chain(&frames, &[("Div", block), ("Add", 1)])?;
    // First sample after the blocks, rounded to the nearest integer; the nearest hop; the hops of the windows.
    let end = g.chain(&blocks, &[("Mul", block * 2 * den * i64::from(SAMPLE_RATE)), ("Add", num), ("Div", 2 * num)])?;
    let n_hops = g.chain(&end, &[("Add", hop / 2), ("Div", hop), ("Add", PARTS as i64 - 1)])?;
    // The sound, extended periodically by its mirror image.
    let last = g.chain(&n, &[("Sub", 1)])?;
    let period = g.chain(&last, &[("Mul", 2), ("Max", 1)])?;
    let index = g.op("Mod", &[&g.range(&g.chain(&n_hops, &[("Mul", hop)])?)?, &period]);
    let at = g.op("Sub", &[&last, &g.op("Abs", &[&g.op("Sub", &[&index, &last])])]);
    let hops = g.reshaped("Reshape", &g.along("Gather", &["samples", &at], 1), &[-1, hop])?;
    add_spectrogram(&g, &g.cast(&hops, ElementType::F64))?;
    Ok(g)
}

/// Adds the output `mels` for the windows that begin at each of the `hops` [n, 160] but the last ones.
fn add_spectrogram(g: &NetworkGraph, hops: &str) -> Result<()> {
    let bands = mel::all_bands();
    // Bins outside all bands are not computed.
    let first = bands.iter().map(|band| band.first).min().unwrap_or(0);
    let end = bands.iter().map(|band| band.first + band.weights.len()).max().unwrap_or(0);
    let (n_bins, window) = (end - first, hann(WINDOW));
    let mut power: Option<String> = None;
    for wave in [f64::cos, f64::sin] {
        let mut sums: Option<String> = None;
        for part in 0..PARTS {
            let basis = (part * HOP..(part + 1) * HOP).flat_map(|i| {
                let weight = window.get(i).copied().map_or(0.0, f64::from);
                (first..end).map(move |bin| weight * wave(TAU * ((i * bin) % FFT) as f64 / FFT as f64))
            });
            let hops = g.slice(hops, 0, [part as i64, (part + 1) as i64 - PARTS as i64])?;
            let products = g.op("MatMul", &[&hops, &g.doubles(&[HOP, n_bins], basis)?]);
            sums = Some(sums.map_or(products.clone(), |sums| g.op("Add", &[&sums, &products])));
        }
        let sums = sums.unwrap_or_default();
        let squares = g.op("Mul", &[&sums, &sums]);
        power = Some(power.map_or(squares.clone(), |power| g.op("Add", &[&power, &squares])));
    }
    let mut weights = vec![0.0; n_bins * N_MELS];
    for (column, band) in bands.iter().enumerate() {
        let rows = band.weights.iter().zip(band.first - first..);
        rows.for_each(|(weight, row)| weights[row * N_MELS + column] = f64::from(*weight));
    }
    let magnitudes = g.op("Sqrt", &[&power.unwrap_or_default()]);
    let mels = g.op("MatMul", &[&magnitudes, &g.doubles(&[n_bins, N_MELS], weights)?]);
    let logs = g.op("Log", &[&g.op("Add", &[&mels, &g.double(f64::from(FLOOR))?])]);
    let mels = g.transposed(&g.cast(&logs, ElementType::F32), &[1, 0]);
    g.output("mels", "Unsqueeze", &[&mels, &g.integers(&[0])?]);
    Ok(())
}
