//! Streaming spectrogram of a sound: pieces are read one after another as spectrogram frames are requested in order,
//! and samples that are no longer needed are dropped. Beyond its end the sound is extended by its mirror image, for
//! which the tail is kept.

use anyhow::Result;
use candle_core::{Device, Tensor};
use orator_base::audio::mel;
use orator_base::types::sound::sample_at;
use orator_base::types::time::FrameRate;
use std::ops::Range;

/// Spectrogram stream of a sound of known length that is read in pieces of any length.
pub struct MelStream<I> {
    pieces: I,
    n_samples: usize,
    /// Buffered samples.
    samples: Vec<f32>,
    /// Index in the sound of the first buffered sample.
    first: usize,
    /// Index from which samples are never dropped, as the mirror image needs them.
    tail: usize,
}

impl<I: Iterator<Item = Result<Vec<f32>>>> MelStream<I> {
    /// Stream over `pieces` of `n_samples` samples in total, of which `n_mel_frames` spectrogram frames will be
    /// requested.
    pub fn new(pieces: I, n_samples: usize, n_mel_frames: usize) -> Self {
        let end = mel::n_samples(n_mel_frames);
        let period = period(n_samples);
        let tail = if end > period { 0 } else { n_samples.min((period + 1).saturating_sub(end)) };
        Self { pieces, n_samples, samples: Vec::new(), first: 0, tail }
    }

    /// Log-mels [1, 64, T] of these spectrogram frames. Successive ranges may overlap, but their starts must not
    /// decrease.
    pub fn log_mels(&mut self, frames: Range<usize>) -> Result<Tensor> {
        let first = frames.start * mel::HOP;
        let mels = mel::log_mel(&self.mirrored(first..first + mel::n_samples(frames.len()))?);
        let shape = (1, mel::N_MELS, frames.len());
        Ok(Tensor::from_iter(mels.t().iter().copied(), &Device::Cpu)?.reshape(shape)?)
    }

    /// These samples of the sound extended periodically by its mirror image.
    fn mirrored(&mut self, range: Range<usize>) -> Result<Vec<f32>> {
        let needed = range.start.min(self.tail);
        if needed > self.first {
            self.samples.drain(..(needed - self.first).min(self.samples.len()));
            self.first = needed;
        }
        while self.first + self.samples.len() < range.end.min(self.n_samples) {
            let n_read = self.first + self.samples.len();
            let Some(piece) = self.pieces.next() else {
                anyhow::bail!(
                    "the audio ended after {n_read} of {} samples: the file changed while it was read",
                    self.n_samples
                )
            };
            self.samples.extend(piece?);
        }
        let period = period(self.n_samples);
        let at = |i: usize| if i < self.n_samples { i } else { period - i };
        let samples: Option<Vec<f32>> =
            range.map(|i| self.samples.get(at(i % period).checked_sub(self.first)?).copied()).collect();
        samples.ok_or_else(|| anyhow::anyhow!("spectrogram frames were requested out of order"))
    }
}

/// Period in samples of a sound that is extended by its mirror image.
fn period(n_samples: usize) -> usize {
    (2 * n_samples).saturating_sub(2).max(1)
}

/// Number of spectrogram frames (10 ms hops) that span `n_frames` frames of motion, rounded to the nearest integer.
pub fn mel_frames(fps: FrameRate, n_frames: usize) -> usize {
    let rate = orator_base::types::sound::SAMPLE_RATE;
    (sample_at(fps, rate, n_frames) + mel::HOP / 2) / mel::HOP
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(samples: &[f32], piece: usize, n_mel_frames: usize) -> MelStream<impl Iterator<Item = Result<Vec<f32>>>> {
        let pieces = samples.chunks(piece).map(|piece| Ok(piece.to_vec())).collect::<Vec<_>>();
        MelStream::new(pieces.into_iter(), samples.len(), n_mel_frames)
    }

    #[test]
    fn sound_is_mirrored_as_long_as_needed() {
        let all = |samples: &[f32], range| stream(samples, 2, 10).mirrored(range).unwrap();
        assert_eq!(all(&[1.0, 2.0, 3.0], 0..8), [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]);
        assert_eq!(all(&[1.0], 0..3), [1.0, 1.0, 1.0]);
        assert_eq!(all(&[1.0, 2.0, 3.0], 3..5), [2.0, 1.0]);
    }

    #[test]
    fn streaming_equals_the_complete_spectrogram_with_a_small_buffer() {
        let samples: Vec<f32> = (0..200_000).map(|i| ((i * 7919) % 1009) as f32 / 1009.0 - 0.5).collect();
        let n_mel_frames = mel::n_frames(210_000);
        let whole = stream(&samples, 200_000, n_mel_frames).log_mels(0..n_mel_frames).unwrap();
        let mut stream = stream(&samples, 999, n_mel_frames);
        let mut most = 0;
        for first in (0..n_mel_frames).step_by(100) {
            let frames = first.saturating_sub(20)..(first + 100).min(n_mel_frames);
            let part = stream.log_mels(frames.clone()).unwrap();
            let expected = whole.narrow(2, frames.start, frames.len()).unwrap();
            let numbers = |t: &Tensor| t.flatten_all().unwrap().to_vec1::<f32>().unwrap();
            assert_eq!(numbers(&part), numbers(&expected));
            most = most.max(stream.samples.len());
        }
        assert!(most < 32_000, "{most} samples at hand");
    }

    #[test]
    fn a_sound_that_became_shorter_is_an_error() {
        let mut stream = stream(&[0.1; 5000], 999, mel::n_frames(6000));
        stream.n_samples = 6000;
        let text = stream.log_mels(0..mel::n_frames(6000)).unwrap_err().to_string();
        assert!(text.contains("5000 of 6000"), "{text}");
    }
}
