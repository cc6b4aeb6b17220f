//! Readers of audio files: WAV with the program's own reader, and other formats with ffmpeg; joined transport streams.

use crate::fixtures::clips::{ffmpeg, tone, write_numbered};
use crate::fixtures::fuzzing::harness::{corpus, folder, fuzz_bytes, fuzz_file};
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_formats::wav;
use orator_media::ffmpeg::frames::FrameReader;
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

#[test]
fn joined_stream() {
    let (dir, fps) = (folder(), FrameRate::new(25, 1));
    write_numbered(dir.path(), "a.mp4", 10, fps, Some(&tone(16_000, 0.4, 500.0)));
    if !ffmpeg(dir.path(), "-i a.mp4 -c copy a.ts") {
        return;
    }
    let recording = std::fs::read(dir.path().join("a.ts")).unwrap();
    fuzz_file("joined_stream", &[recording.repeat(2)], "a.ts", |path| {
        if let Ok(frames) = FrameReader::open(path, fps) {
            frames.take(100).for_each(drop);
        }
        let _ = audio::read_sound(path);
    });
}
