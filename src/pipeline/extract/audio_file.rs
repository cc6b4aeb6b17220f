//! Writes the sound of a video to a WAV file piece by piece, so that memory does not grow with its length.

use anyhow::Result;
use orator_base::types::sound::AudioTracks;
use orator_formats::wav::WavWriter;
use orator_media::ffmpeg::audio::stream_mono;
use std::path::Path;

/// The sound that `extract_wav` wrote.
#[derive(Clone, Debug, PartialEq)]
pub struct Extracted {
    /// Length in seconds.
    pub secs: f64,
    /// Track that was read, and the others.
    pub tracks: AudioTracks,
    /// Sentence about what was left out.
    pub damage: Option<String>,
}

/// Writes the sound track `track` of `path` (from 1; 0: the automatic choice) to the 16-bit mono wav `out`, a piece at a
/// time; `None` (and no file) when there is no sound.
pub fn extract_wav(path: &Path, track: usize, out: &Path, rate: u32) -> Result<Option<Extracted>> {
    let mut wav = None;
    let heard = stream_mono(path, track, rate, &mut |piece| {
        if wav.is_none() {
            wav = Some(WavWriter::create(out, rate)?);
        }
        wav.as_mut().map_or(Ok(()), |wav: &mut WavWriter| wav.push(piece))
    })?;
    if let Some(wav) = wav {
        wav.finish()?;
    }
    Ok(heard.map(|heard| {
        let (secs, damage) = (heard.n_samples as f64 / f64::from(rate), heard.damage());
        Extracted { secs, tracks: heard.tracks, damage }
    }))
}
