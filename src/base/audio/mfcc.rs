//! Mel-frequency cepstral coefficients as computed by FineMotion (Korzun et al. 2020, with the library
//! python_speech_features): 26 coefficients of 26 bands every 10 ms, the first replaced by the log energy; their means
//! over poses, and padding of these by context.

use ndarray::Array2;
use realfft::RealFftPlanner;
use std::f64::consts::PI;

/// Number of cepstral coefficients, and of mel bands.
pub const N_CEPSTRA: usize = 26;
/// Length of the Fourier transform in samples.
pub const FFT: usize = 1024;
/// Window length and hop in seconds.
const WINDOW_SECS: f64 = 0.02;
pub const STEP_SECS: f64 = 0.01;
/// Part of the preceding sample that is subtracted from a sample.
pub const PRE_EMPHASIS: f64 = 0.97;
const LIFTER: f64 = 22.0;
/// Full scale of 16-bit samples, on which the log energy depends.
pub const FULL_SCALE: f64 = 32_768.0;

/// Coefficients of mono sound at `rate` samples per second (at most 51.2 kHz, where a window fills the transform),
/// samples in -1..1: [n, 26]. Row k covers the 20 ms from k * 10 ms on; the last window is padded with zeros.
pub fn mfcc(samples: &[f32], rate: u32) -> Array2<f64> {
    let [length, step] = window_and_hop(rate);
    let n = match samples.len() {
        0 => 0,
        n if n <= length => 1,
        n => 1 + (n - length).div_ceil(step),
    };
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(FFT);
    let (mut frame, mut spectrum) = (fft.make_input_vec(), fft.make_output_vec());
    let mut work = fft.make_scratch_vec();
    let (bands, cosines) = (bands(rate), cosines());
    let sample = |i: usize| samples.get(i).map_or(0.0, |v| FULL_SCALE * f64::from(*v));
    // As in python_speech_features, samples after the end are zero, and not the pre-emphasis of the step to zero.
    let emphasised = |i: usize| match i {
        0 => sample(0),
        _ if i >= samples.len() => 0.0,
        _ => sample(i) - PRE_EMPHASIS * sample(i - 1),
    };
    let mut cepstra = Array2::zeros((n, N_CEPSTRA));
    for (k, mut row) in cepstra.outer_iter_mut().enumerate() {
        frame.fill(0.0);
        (0..length).for_each(|i| frame[i] = emphasised(k * step + i));
        // Buffer lengths are those of the transform, so it cannot fail.
        let _ = fft.process_with_scratch(&mut frame, &mut spectrum, &mut work);
        let power: Vec<f64> = spectrum.iter().map(|bin| bin.norm_sqr() / FFT as f64).collect();
        let log = |v: f64| if v == 0.0 { f64::EPSILON.ln() } else { v.ln() };
        let mels: Vec<f64> =
            bands.iter().map(|band| log(band.iter().zip(&power).map(|(weight, power)| weight * power).sum())).collect();
        for (c, value) in row.iter_mut().enumerate() {
            *value = lift(c) * mels.iter().zip(cosines.row(c)).map(|(mel, cosine)| mel * cosine).sum::<f64>();
        }
        row[0] = log(power.iter().sum());
    }
    cepstra
}

/// Window length and hop in samples.
pub fn window_and_hop(rate: u32) -> [usize; 2] {
    let samples = |secs: f64| ((secs * f64::from(rate)).round() as usize).max(1);
    [samples(WINDOW_SECS).min(FFT), samples(STEP_SECS)]
}

/// Factor of coefficient `c`.
pub fn lift(c: usize) -> f64 {
    1.0 + LIFTER / 2.0 * (PI * c as f64 / LIFTER).sin()
}

/// Computes coefficients of `n` poses [n, 26] at `fps` per second: the mean of the rows of [`mfcc`] over each pose,
/// where rows at its edges count partially (at 20 per second a pose has five complete rows). After the end of the
/// sound its last row is repeated; without sound the result is zero.
pub fn of_poses(samples: &[f32], rate: u32, fps: f64, n: usize) -> Array2<f64> {
    let rows = mfcc(samples, rate);
    let per_pose = 1.0 / (fps * STEP_SECS);
    let mut means = Array2::zeros((n, N_CEPSTRA));
    let Some(last) = rows.nrows().checked_sub(1) else { return means };
    for (t, mut mean) in means.outer_iter_mut().enumerate() {
        let (start, end) = (t as f64 * per_pose, (t + 1) as f64 * per_pose);
        let mut at = start;
        while end - at > 1e-9 {
            // Tolerates rounding errors at the edges of rows.
            let row = (at + 1e-9).floor();
            let next = (row + 1.0).min(end);
            mean.scaled_add((next - at) / per_pose, &rows.row(last.min(row as usize)));
            at = next;
        }
    }
    means
}

/// Number of poses that are completely covered by a sound of `n_samples`.
pub fn n_poses(n_samples: usize, rate: u32, fps: f64) -> usize {
    (n_samples as f64 / f64::from(rate) * fps + 1e-6) as usize
}

/// Pads rows [n, 26] with half a context (an odd number of rows) of `silence` before and after: [n + context - 1, 26].
pub fn with_context(rows: &Array2<f64>, context: usize, silence: &[f64; N_CEPSTRA]) -> Array2<f32> {
    let half = context / 2;
    Array2::from_shape_fn((rows.nrows() + 2 * half, N_CEPSTRA), |(t, c)| {
        let inside = t.checked_sub(half).filter(|&t| t < rows.nrows());
        inside.map_or(silence[c], |t| rows[[t, c]]) as f32
    })
}

/// Coefficients of silence: the first row of digital silence. FineMotion pads with the first row of a silent recording.
pub fn silence(rate: u32) -> [f64; N_CEPSTRA] {
    let rows = mfcc(&[0.0; 1], rate);
    std::array::from_fn(|c| rows[[0, c]])
}

/// Weights of each band over the bins [26][513]: triangles between bins that are equally spaced in mel.
pub fn bands(rate: u32) -> Vec<Vec<f64>> {
    let max_mel = 2595.0 * (1.0 + f64::from(rate) / 2.0 / 700.0).log10();
    let corner = |i: usize| {
        let hz = 700.0 * (10f64.powf(max_mel * i as f64 / (N_CEPSTRA + 1) as f64 / 2595.0) - 1.0);
        ((FFT + 1) as f64 * hz / f64::from(rate)).floor()
    };
    let weights = |band: usize| {
        let (left, middle, right) = (corner(band), corner(band + 1), corner(band + 2));
        let weight = |bin: usize| match bin as f64 {
            at if at >= left && at < middle => (at - left) / (middle - left),
            at if at >= middle && at < right => (right - at) / (right - middle),
            _ => 0.0,
        };
        (0..=FFT / 2).map(weight).collect()
    };
    (0..N_CEPSTRA).map(weights).collect()
}

/// Orthonormal cosine transform [coefficient, band].
pub fn cosines() -> Array2<f64> {
    let n = N_CEPSTRA as f64;
    Array2::from_shape_fn((N_CEPSTRA, N_CEPSTRA), |(c, band)| {
        let scale = if c == 0 { 1.0 / n } else { 2.0 / n };
        scale.sqrt() * (PI * c as f64 * (band as f64 + 0.5) / n).cos()
    })
}
