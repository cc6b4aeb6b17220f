//! Spectra of the windows of a sound, in one piece or in chunks of any length.

use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Fourier transform of weighted windows, with its buffers.
pub struct Spectrum {
    weights: Vec<f32>,
    fft: Arc<dyn RealToComplex<f32>>,
    frame: Vec<f32>,
    bins: Vec<Complex<f32>>,
    scratch: Vec<Complex<f32>>,
}

impl Spectrum {
    /// Creates a transform of windows with these weights, padded with zeros to `n_fft` samples.
    pub fn new(weights: Vec<f32>, n_fft: usize) -> Self {
        let fft = RealFftPlanner::<f32>::new().plan_fft_forward(n_fft);
        let (frame, bins, scratch) = (fft.make_input_vec(), fft.make_output_vec(), fft.make_scratch_vec());
        Self { weights, fft, frame, bins, scratch }
    }

    /// Returns the bins of a window's samples.
    pub fn of(&mut self, sound: &[f32]) -> &[Complex<f32>] {
        self.frame.fill(0.0);
        self.frame.iter_mut().zip(sound).zip(&self.weights).for_each(|((y, x), w)| *y = x * w);
        // Buffer lengths are those of the transform, so it cannot fail.
        let _ = self.fft.process_with_scratch(&mut self.frame, &mut self.bins, &mut self.scratch);
        &self.bins
    }
}

/// Spectra of a sound that arrives in chunks, one window every `hop` samples.
pub struct StreamedSpectra {
    spectrum: Spectrum,
    hop: usize,
    /// Buffered samples from the start of the next window on.
    buffered: Vec<f32>,
}

impl StreamedSpectra {
    /// Creates a stream of windows with these weights; `first` is put before the first samples.
    pub fn new(weights: Vec<f32>, hop: usize, first: Vec<f32>) -> Self {
        let n = weights.len();
        Self { spectrum: Spectrum::new(weights, n), hop, buffered: first }
    }

    /// Processes the next samples; `each` is called with the samples and bins of every window that is now complete.
    pub fn push(&mut self, samples: &[f32], mut each: impl FnMut(&[f32], &[Complex<f32>])) {
        self.buffered.extend_from_slice(samples);
        let mut start = 0;
        while let Some(sound) = self.buffered.get(start..start + self.spectrum.weights.len()) {
            each(sound, self.spectrum.of(sound));
            start += self.hop;
        }
        self.buffered.drain(..start);
    }
}

/// Periodic Hann window.
pub fn hann(n: usize) -> Vec<f32> {
    (0..n).map(|i| (0.5 - 0.5 * (TAU * i as f64 / n as f64).cos()) as f32).collect()
}
