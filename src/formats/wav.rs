//! Sound of a shard: 16-bit mono WAV with the plain 44-byte header, in memory. Files of others are read in `media`.

use crate::types::sound::Sound;
use anyhow::{Result, ensure};

/// Bytes before the first sample.
pub const HEADER_BYTES: usize = 44;

fn header(rate: u32, n_samples: usize) -> [u8; HEADER_BYTES] {
    let data_bytes = 2 * n_samples as u32;
    let mut bytes = *b"RIFF....WAVEfmt \x10\0\0\0\x01\0\x01\0........\x02\0\x10\0data....";
    bytes[4..8].copy_from_slice(&(36 + data_bytes).to_le_bytes());
    bytes[24..28].copy_from_slice(&rate.to_le_bytes());
    bytes[28..32].copy_from_slice(&(2 * rate).to_le_bytes());
    bytes[40..44].copy_from_slice(&data_bytes.to_le_bytes());
    bytes
}

/// The sound as a WAV file; samples outside -1..1 are clipped. `sound` of another wav comes back bit for bit.
pub fn write(sound: &Sound) -> Vec<u8> {
    let mut bytes = header(sound.rate, sound.samples.len()).to_vec();
    bytes.resize(HEADER_BYTES + 2 * sound.samples.len(), 0);
    let places = bytes[HEADER_BYTES..].as_chunks_mut::<2>().0;
    for (place, sample) in places.iter_mut().zip(&sound.samples) {
        let value = f64::from(sample * 32_768.0);
        // Halves away from zero, as `round` has it, exactly; `round` itself is a slow call.
        *place = ((value + 0.5f64.copysign(value)) as i16).to_le_bytes();
    }
    bytes
}

/// How many samples a file of `file_bytes` that begins with `bytes` holds; it must be as `write` makes it.
pub fn n_samples(bytes: &[u8], file_bytes: u64, rate: u32) -> Result<usize> {
    let n_samples = (file_bytes.saturating_sub(HEADER_BYTES as u64) / 2) as usize;
    ensure!(
        bytes.starts_with(&header(rate, n_samples)) && file_bytes == (HEADER_BYTES + 2 * n_samples) as u64,
        "not a 16-bit mono WAV file at {rate} Hz with a 44-byte header"
    );
    Ok(n_samples)
}

/// Little endian 16-bit samples as -1..1.
pub fn samples(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(2).map(|b| f32::from(i16::from_le_bytes([b[0], b[1]])) / 32_768.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_comes_back_and_others_can_read_it() {
        let all: Vec<f32> = (i16::MIN..=i16::MAX).map(|n| f32::from(n) / 32_768.0).collect();
        let bytes = write(&Sound { rate: 16_000, samples: all.clone() });
        assert_eq!(n_samples(&bytes[..44], bytes.len() as u64, 16_000).unwrap(), all.len());
        assert_eq!(samples(&bytes[44..]), all);
        let reader = hound::WavReader::new(&bytes[..]).unwrap();
        assert_eq!((reader.spec().sample_rate, reader.spec().channels, reader.len()), (16_000, 1, 65_536));
        assert_eq!(write(&Sound { rate: 16_000, samples: vec![1.5] })[44..], i16::MAX.to_le_bytes());
        assert!(n_samples(&bytes[..44], bytes.len() as u64 - 2, 16_000).is_err());
        assert!(n_samples(&bytes[..20], 20, 16_000).is_err());
    }
}
