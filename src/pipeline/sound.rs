//! The sound of a video: extracted to a wav file, and from that, read as a stream, its loudness at each frame and how open
//! the voice sounds. Memory does not grow with the length.

use anyhow::{Context, Result};
use orator_base::audio::openness::{Openness, OpennessMeter};
use orator_base::types::time::FrameRate;
use orator_formats::wav::WavWriter;
use orator_media::ffmpeg::audio::{StreamedSound, stream_mono};
use std::path::Path;

/// Loudness is taken over this many seconds around a frame: syllables and short pauses even out.
const AROUND_SECS: f64 = 1.0;
/// Digital silence, dB.
const NOTHING_DB: f64 = -120.0;
/// Samples read at a time.
const PIECE: usize = 1 << 14;

/// Writes the sound track `track` of the video `path` (from 1; 0: the automatic choice) to the 16-bit mono wav `out`; `None`
/// (and no file) when there is no sound.
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

/// Whether each frame has sound (1 or 0), and its loudness: the root mean square of the second around it in dB
/// of full scale, -120 where there is none. A file that is not there has no sound.
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
    let reach = (AROUND_SECS / 2.0 * fps.per_sec()).round() as usize;
    let loudness = |t: usize| {
        let around = t.saturating_sub(reach)..n_frames.min(t + reach + 1);
        let n: u64 = n_samples[around.clone()].iter().sum();
        let mean = power[around].iter().sum::<f64>() / n.max(1) as f64;
        (10.0 * mean.max(1e-30).log10()).max(NOTHING_DB) as f32
    };
    let there = n_samples.iter().map(|&n| f32::from(u8::from(n > 0))).collect();
    Ok((there, (0..n_frames).map(loudness).collect()))
}

/// How open the voice in a file of 16 kHz sounds; a file that is not there has none.
pub fn openness(path: &Path) -> Result<Openness> {
    let mut meter = OpennessMeter::default();
    if path.exists() {
        pieces(path, PIECE, |piece| {
            meter.push(piece);
            Ok(())
        })?;
    }
    Ok(meter.finish())
}

/// Passes the samples of a 16-bit mono wav file, -1..1, to `work` in pieces of `n`, the last of which may be shorter.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_then_quiet_then_the_end() {
        let path = tempfile::tempdir().unwrap().keep().join("tone.wav");
        let spec = hound::WavSpec {
            channels: 1,
            sample_rate: 16_000,
            bits_per_sample: 16,
            sample_format: hound::SampleFormat::Int,
        };
        let mut wav = hound::WavWriter::create(&path, spec).unwrap();
        for n in 0..16_000 * 6 {
            let amplitude = if n < 48_000 { 0.1 } else { 0.0001 };
            wav.write_sample((amplitude * 32_768.0 * (f64::from(n) * 0.3).sin()).round() as i16).unwrap();
        }
        wav.finalize().unwrap();
        let (there, db) = levels(&path, FrameRate::new(15, 1), 100).unwrap();
        assert_eq!(there.iter().sum::<f32>(), 90.0);
        assert!((db[20] + 23.0).abs() < 0.1, "{}", db[20]);
        assert!((db[70] + 83.0).abs() < 3.0, "{}", db[70]);
        assert_eq!(db[99], -120.0);
        assert_eq!(levels(Path::new("no.wav"), FrameRate::new(15, 1), 2).unwrap(), (vec![0.0; 2], vec![-120.0; 2]));
        std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
    }
}
