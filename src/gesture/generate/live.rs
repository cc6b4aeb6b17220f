//! Generation from speech that is not over yet, by a network with a limited look-ahead: a stream of poses without
//! end, each computed as soon as the sound that it depends on has arrived.

use super::generator::{GestureGenerator, log_mel_tensor, network_output};
use anyhow::{Context, Result};
use candle_core::Tensor;
use ndarray::Array2;
use orator_base::audio::mel;
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_nn::gan::generator::Preset;
use orator_nn::gan::look_ahead::LookAhead;
use orator_nn::gan::streaming::{FRAMES_READ_AHEAD, StreamingGenerator};
use std::ops::Range;

/// Number of pose frames of a stream "without end", two months at 15 fps; and of its spectrogram frames.
const MAX_FRAMES: usize = 1 << 26;
const MAX_MEL_FRAMES: usize = 1 << 30;

/// Smallest and largest look-ahead, seconds.
pub const LOOK_AHEAD_SECS: [f64; 2] = [0.25, 2.0];
const MELS_PER_SEC: usize = SAMPLE_RATE as usize / mel::HOP;

/// Look-ahead of `secs` for poses at `fps`.
pub fn look_ahead(preset: Preset, secs: f64, fps: FrameRate) -> LookAhead {
    let mels_per_frame = (MELS_PER_SEC * fps.den as usize, fps.num as usize);
    let window = mel::WINDOW as f64 / mel::HOP as f64;
    LookAhead::new(preset, secs, mels_per_frame, MELS_PER_SEC as f64, window)
}

impl GestureGenerator {
    /// Look-ahead of the network.
    ///
    /// # Errors
    /// A network that reads the complete speech.
    pub fn look_ahead(&self) -> Result<LookAhead> {
        self.metadata.network.look_ahead.with_context(|| {
            let secs = self.fps().secs(FRAMES_READ_AHEAD);
            format!(
                "the model of {} reads {secs:.1} s of speech after each pose, so it cannot follow speech that is not over \
                 yet: train one with `--set gan.look_ahead_secs=0.5`",
                self.name()
            )
        })
    }

    /// Raw network output [features, `chunk`] of successive chunks for `pieces` of sound (16 kHz) of any length; silence
    /// follows the last piece. A piece is only requested when the next chunk depends on it.
    ///
    /// # Errors
    /// As for [`Self::look_ahead`].
    pub fn live_features(
        &self,
        pieces: impl Iterator<Item = Result<Vec<f32>>>,
        chunk: usize,
    ) -> Result<impl Iterator<Item = Result<Array2<f32>>>> {
        let mut stream = OpenSound::new(pieces, self.look_ahead()?.shift);
        let mels = move |frames| stream.log_mels(frames).map_err(|error| candle_core::Error::Msg(format!("{error:#}")));
        let preset = self.metadata.network.preset;
        let chunks = StreamingGenerator::new(&self.generator, preset, MAX_MEL_FRAMES, MAX_FRAMES, chunk, mels)?;
        Ok(chunks.enumerate().map(move |(i, poses)| network_output(&poses?, i * chunk)))
    }
}

/// Sound that arrives in pieces, moved by a number of spectrogram frames; silence before and after it.
struct OpenSound<I> {
    pieces: I,
    samples: Vec<f32>,
    /// Index of the first buffered sample. The silence that a negative shift inserts at the start counts.
    first: usize,
    /// Number of samples that a positive shift omits at the start.
    n_omitted: usize,
}

impl<I: Iterator<Item = Result<Vec<f32>>>> OpenSound<I> {
    fn new(pieces: I, shift: i64) -> Self {
        let silence = vec![0.0; shift.min(0).unsigned_abs() as usize * mel::HOP];
        Self { pieces, samples: silence, first: 0, n_omitted: shift.max(0) as usize * mel::HOP }
    }

    /// Log-mels [1, 64, T] of these spectrogram frames. Successive ranges may overlap, but starts must not decrease.
    fn log_mels(&mut self, frames: Range<usize>) -> Result<Tensor> {
        let start = frames.start * mel::HOP + self.n_omitted;
        let end = start + mel::n_samples(frames.len());
        while self.first + self.samples.len() < end {
            match self.pieces.next() {
                Some(piece) => self.samples.extend(piece?),
                None => self.samples.resize(end - self.first, 0.0),
            }
        }
        let unused = start.checked_sub(self.first).context("spectrogram frames were requested out of order")?;
        self.samples.drain(..unused);
        self.first = start;
        log_mel_tensor(&self.samples[..end - start])
    }
}
