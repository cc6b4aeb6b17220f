//! Sound features for evaluation, computed on a stream of samples that are not stored: onsets for the beat metrics,
//! and a pooled spectrogram for the nearest neighbour.

use crate::generate::generator::mel_frames;
use anyhow::{Context, Result};
use orator_base::audio::mel;
use orator_base::audio::onset::{Loudest, Onsets};
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::sound_stream::SoundStream;
use std::path::Path;

/// Motion frames whose spectrogram is averaged into one row.
pub const POOLED: usize = 2;
/// Number of buffered samples that triggers a spectrogram.
const PIECE: usize = 10 * SAMPLE_RATE as usize;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct SoundFeatures {
    pub secs: f64,
    /// Onset times, seconds from the start.
    pub onsets: Vec<f64>,
    /// Mean of the log-mel spectrogram over every `POOLED` motion frames: rows of `mel::N_MELS` values.
    pub rows: Vec<f32>,
}

/// Extractor for sound of 16 kHz.
pub struct SoundFeatureExtractor {
    fps: FrameRate,
    n_samples: usize,
    onsets: Option<Onsets>,
    /// Buffered samples, starting with spectrogram frame `n_mels`.
    buffered: Vec<f32>,
    n_mels: usize,
    /// Sum of the spectrogram frames of the current row.
    row: [f32; mel::N_MELS],
    /// Number of spectrogram frames in the current row.
    n_in_row: usize,
    rows: Vec<f32>,
}

impl SoundFeatureExtractor {
    /// Extractor for motion of `fps`. Onsets are found only with a known peak level (`onset::Loudest`).
    pub fn new(fps: FrameRate, loudest_db: Option<f32>) -> Self {
        Self {
            fps,
            n_samples: 0,
            onsets: loudest_db.map(Onsets::new),
            buffered: Vec::new(),
            n_mels: 0,
            row: [0.0; mel::N_MELS],
            n_in_row: 0,
            rows: Vec::new(),
        }
    }

    pub fn push(&mut self, samples: &[f32]) {
        self.n_samples += samples.len();
        if let Some(onsets) = &mut self.onsets {
            onsets.push(samples);
        }
        self.buffered.extend_from_slice(samples);
        if self.buffered.len() >= PIECE {
            self.pool();
        }
    }

    /// Features of a sound cut or padded with silence to `n_frames` of motion.
    pub fn finish(mut self, n_frames: usize) -> SoundFeatures {
        let secs = self.n_samples as f64 / f64::from(SAMPLE_RATE);
        let n_rows = n_frames.div_ceil(POOLED);
        let range = mel::n_samples(mel_frames(self.fps, n_rows * POOLED) + 1);
        let more = range.saturating_sub(self.n_mels * mel::HOP + self.buffered.len());
        self.buffered.resize(self.buffered.len() + more, 0.0);
        self.pool();
        self.rows.truncate(n_rows * mel::N_MELS);
        let until = self.fps.secs(n_frames);
        let mut onsets = self.onsets.map(Onsets::finish).unwrap_or_default();
        onsets.retain(|onset| *onset < until);
        SoundFeatures { secs, onsets, rows: self.rows }
    }

    fn pool(&mut self) {
        let mels = mel::log_mel(&self.buffered);
        for frame in mels.outer_iter() {
            self.row.iter_mut().zip(frame).for_each(|(sum, v)| *sum += v);
            self.n_in_row += 1;
            self.n_mels += 1;
            // One frame completes several rows if the motion has a higher frame rate than the spectrogram.
            while self.n_mels >= mel_frames(self.fps, (self.rows.len() / mel::N_MELS + 1) * POOLED) {
                match self.n_in_row {
                    0 => self.rows.extend_from_within(self.rows.len() - mel::N_MELS..),
                    n => self.rows.extend(self.row.iter().map(|sum| sum / n as f32)),
                }
                self.row.fill(0.0);
                self.n_in_row = 0;
            }
        }
        self.buffered.drain(..(mels.nrows() * mel::HOP).min(self.buffered.len()));
    }
}

/// Features of a sound of 16 kHz for `n_frames` of motion.
pub fn from_samples(samples: &[f32], fps: FrameRate, n_frames: usize) -> SoundFeatures {
    let mut loudest = Loudest::default();
    loudest.push(samples);
    let mut extractor = SoundFeatureExtractor::new(fps, Some(loudest.finish()));
    extractor.push(samples);
    extractor.finish(n_frames)
}

/// Features of a file for `n_frames` of motion. The file is decoded twice, only as far as needed. `None`: no sound.
pub fn extract(path: &Path, fps: FrameRate, n_frames: usize) -> Result<Option<SoundFeatures>> {
    // One second more, so that an onset at the end stands out from what follows.
    let n_wanted = ((fps.secs(n_frames) + 1.0) * f64::from(SAMPLE_RATE)).ceil() as usize;
    let decode = |sink: &mut dyn FnMut(&[f32])| -> Result<usize> {
        let mut n = 0;
        for piece in SoundStream::open(path, SAMPLE_RATE) {
            let piece = piece.with_context(|| format!("cannot read the audio of {}", path.display()))?;
            n += piece.len();
            sink(&piece);
            if n >= n_wanted {
                break;
            }
        }
        Ok(n)
    };
    let mut loudest = Loudest::default();
    if decode(&mut |samples| loudest.push(samples))? == 0 {
        return Ok(None);
    }
    let mut extractor = SoundFeatureExtractor::new(fps, Some(loudest.finish()));
    decode(&mut |samples| extractor.push(samples))?;
    Ok(Some(extractor.finish(n_frames)))
}
