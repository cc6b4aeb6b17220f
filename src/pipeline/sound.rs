//! Audio of a video: extraction to a wav file and, streamed from that file, its loudness per frame and the openness of
//! the voice. Memory use does not grow with the length.

use anyhow::{Context, Result};
use orator_base::audio::openness::{Openness, OpennessMeter};
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_formats::wav::WavWriter;
use orator_media::ffmpeg::audio::{StreamedSound, stream_mono};
use std::ops::Range;
use std::path::Path;

/// Window of the loudness in seconds; it averages over syllables and short pauses.
const LOUDNESS_SECS: f64 = 1.0;
/// Loudness of digital silence, dB.
const SILENCE_DB: f64 = -120.0;
/// Samples per level of `loud_ranges`; range of the levels of speech below the loudest ones, and lowest level of speech,
/// dB; margin around speech, and pauses that are part of it, seconds.
const LEVEL_SAMPLES: usize = 1_600;
const SPEECH_RANGE_DB: f32 = 40.0;
const SOFTEST_DB: f32 = -65.0;
const MARGIN_SECS: f64 = 0.4;
const MAX_PAUSE_SECS: f64 = 2.0;
/// Samples per read.
const CHUNK_SAMPLES: usize = 1 << 14;

/// Writes audio track `track` (from 1; 0: automatic choice) of the video `path` to the 16-bit mono wav file `out`.
/// Returns `None` and writes no file if there is no audio.
pub fn extract_wav(path: &Path, track: usize, out: &Path, rate: u32) -> Result<Option<StreamedSound>> {
    let mut wav = None;
    let streamed = stream_mono(path, track, rate, &mut |piece| {
        if wav.is_none() {
            wav = Some(WavWriter::create(out, rate)?);
        }
        wav.as_mut().map_or(Ok(()), |wav: &mut WavWriter| wav.push(piece))
    })?;
    wav.map_or(Ok(()), WavWriter::finish)?;
    Ok(streamed)
}

/// Per frame, whether there is audio (1 or 0) and its loudness: the root mean square of the second around it in dB of
/// full scale, -120 for silence. A missing file counts as no audio.
pub fn levels(path: &Path, fps: FrameRate, n_frames: usize) -> Result<(Vec<f32>, Vec<f32>)> {
    let (mut n_samples, mut power) = (vec![0_u64; n_frames], vec![0.0_f64; n_frames]);
    if path.exists() {
        let reading = || format!("cannot read {}", path.display());
        let mut wav = hound::WavReader::open(path).with_context(reading)?;
        let rate = f64::from(wav.spec().sample_rate.max(1));
        for (at, sample) in wav.samples::<i16>().enumerate() {
            let level = f64::from(sample.with_context(reading)?) / 32_768.0;
            let frame = (at as f64 / rate * fps.per_sec() + 1e-9) as usize;
            if frame >= n_frames {
                break;
            }
            n_samples[frame] += 1;
            power[frame] += level * level;
        }
    }
    let half_window = (LOUDNESS_SECS / 2.0 * fps.per_sec()).round() as usize;
    let loudness = |t: usize| {
        let around = t.saturating_sub(half_window)..n_frames.min(t + half_window + 1);
        let n: u64 = n_samples[around.clone()].iter().sum();
        let mean = power[around].iter().sum::<f64>() / n.max(1) as f64;
        (10.0 * mean.max(1e-30).log10()).max(SILENCE_DB) as f32
    };
    let has_audio = n_samples.iter().map(|&n| f32::from(u8::from(n > 0))).collect();
    Ok((has_audio, (0..n_frames).map(loudness).collect()))
}

/// Openness of the voice in a 16 kHz wav file; empty if the file does not exist.
pub fn openness(path: &Path) -> Result<Openness> {
    let mut meter = OpennessMeter::default();
    if path.exists() {
        pieces(path, CHUNK_SAMPLES, |piece| {
            meter.push(piece);
            Ok(())
        })?;
    }
    Ok(meter.finish())
}

/// Passes the samples of a 16-bit mono wav file, -1..1, to `work` in chunks of `n`; the last may be shorter.
pub fn pieces(path: &Path, n: usize, mut work: impl FnMut(&[f32]) -> Result<()>) -> Result<()> {
    let reading = || format!("cannot read {}", path.display());
    let mut wav = hound::WavReader::open(path).with_context(reading)?;
    let mut piece = Vec::with_capacity(n);
    for sample in wav.samples::<i16>() {
        piece.push(f32::from(sample.with_context(reading)?) / 32_768.0);
        if piece.len() == n {
            work(&piece)?;
            piece.clear();
        }
    }
    if piece.is_empty() { Ok(()) } else { work(&piece) }
}

/// Ranges in seconds of a 16 kHz wav file that may contain speech, by loudness alone: parts as loud as soft speech, each
/// with a margin; ranges less than 2 s apart are one.
pub fn loud_ranges(path: &Path) -> Result<Vec<Range<f64>>> {
    let mut levels = Vec::new();
    pieces(path, LEVEL_SAMPLES, |piece| {
        let power = piece.iter().map(|level| level * level).sum::<f32>() / piece.len() as f32;
        levels.push((10.0 * power.max(1e-12).log10()).max(SILENCE_DB as f32));
        Ok(())
    })?;
    let mut sorted = levels.clone();
    sorted.sort_by(f32::total_cmp);
    let loudest = sorted.get(sorted.len() * 95 / 100).copied().unwrap_or_default();
    let softest = (loudest - SPEECH_RANGE_DB).max(SOFTEST_DB);
    let secs = |n: usize| (n * LEVEL_SAMPLES) as f64 / f64::from(SAMPLE_RATE);
    let mut ranges: Vec<Range<f64>> = Vec::new();
    for at in (0..levels.len()).filter(|at| levels[*at] >= softest) {
        let (start, end) = (secs(at) - MARGIN_SECS, (secs(at + 1) + MARGIN_SECS).min(secs(levels.len())));
        match ranges.last_mut().filter(|range| start - range.end < MAX_PAUSE_SECS) {
            Some(range) => range.end = end,
            None => ranges.push(start.max(0.0)..end),
        }
    }
    Ok(ranges)
}
