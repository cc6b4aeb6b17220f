//! Readers of audio files: WAV with the program's own reader, and other formats with ffmpeg.

use crate::fixtures::fuzzing::harness::{corpus, fuzz_bytes, fuzz_file};
use orator_base::types::sound::SAMPLE_RATE;
use orator_formats::wav;
use orator_media::ffmpeg::{audio, probe};

#[test]
fn wav_header() {
    fuzz_bytes("wav_header", &corpus("media", "a.wav"), |bytes| {
        if wav::n_samples(bytes, bytes.len() as u64, SAMPLE_RATE).is_ok() {
            drop(wav::samples(&bytes[wav::HEADER_BYTES..]));
        }
    });
}

#[test]
fn audio_file() {
    fuzz_file("audio_file", &corpus("media", "a.wav"), "a.wav", |path| {
        if probe::probe(path).is_ok() {
            let _ = audio::read_sound(path);
        }
    });
}
