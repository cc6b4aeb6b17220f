//! Speech in real time: late, fast, incomplete and wrong input.

use orator_live::sound::{LiveSound, PIECE};
use std::io::{Cursor, Read};
use std::thread;
use std::time::{Duration, Instant};

/// Samples as bytes, in reads of `n` bytes with a pause before each.
struct Source {
    bytes: Cursor<Vec<u8>>,
    n: usize,
    pause: Duration,
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        thread::sleep(self.pause);
        let n = self.n.min(buffer.len());
        self.bytes.read(&mut buffer[..n])
    }
}

fn ramp(n: usize) -> Vec<u8> {
    (0..n).flat_map(|i| (i as i16).to_le_bytes()).collect()
}

/// Samples of a session, what it reports, and the error that ended it.
fn taken(source: Source, start: Option<Instant>) -> (Vec<f32>, orator_live::sound::SoundFacts, Option<String>) {
    let sound = LiveSound::default();
    let reader = sound.clone();
    let reading = thread::spawn(move || reader.read_pcm(source));
    let (mut samples, mut error) = (Vec::new(), None);
    for piece in sound.pieces(start) {
        match piece {
            Ok(piece) => samples.extend(piece),
            Err(found) => {
                error = Some(format!("{found:#}"));
                break;
            }
        }
    }
    assert_eq!(sound.n_samples_at_end().is_some(), error.is_none());
    sound.close();
    reading.join().unwrap();
    (samples, sound.facts(), error)
}

#[test]
fn samples_arrive_unchanged_whatever_the_reads() {
    for (n_samples, n) in [(5000, 1), (5000, 3), (40_000, 4096), (1, 2), (0, 7), (PIECE, 4095)] {
        let source = Source { bytes: Cursor::new(ramp(n_samples)), n, pause: Duration::ZERO };
        let (samples, facts, error) = taken(source, None);
        let expected: Vec<f32> = (0..n_samples).map(|i| f32::from(i as i16) / 32_768.0).collect();
        assert!(samples == expected && error.is_none(), "{n_samples} by {n}: {error:?}");
        assert_eq!((facts.n_samples, facts.n_gaps, facts.notes.len()), (n_samples, 0, 0));
    }
    let source = Source { bytes: Cursor::new([ramp(700), vec![1]].concat()), n: 512, pause: Duration::ZERO };
    let (samples, facts, _) = taken(source, None);
    assert_eq!((samples.len(), facts.notes.len()), (700, 1));
}

#[test]
fn audio_files_on_standard_input_are_errors() {
    for start in ["RIFF\0\0\0\0WAVEfmt ", "fLaC", "OggS", "ID3\x04"] {
        let bytes = Cursor::new([start.as_bytes(), &[0; 200]].concat());
        for n in [1, 4096] {
            let source = Source { bytes: bytes.clone(), n, pause: Duration::ZERO };
            let (_, _, error) = taken(source, None);
            assert!(
                error.as_ref().is_some_and(|error| error.contains("ffmpeg -i FILE -f s16le")),
                "{start}: {error:?}"
            );
        }
    }
    let mut failing = Source { bytes: Cursor::new(Vec::new()), n: 1, pause: Duration::ZERO };
    failing.bytes.set_position(u64::MAX);
    assert_eq!(taken(failing, None).0.len(), 0);
}

#[test]
fn late_speech_is_replaced_by_silence_and_follows_it() {
    // Bursts of a tenth of a second with pauses of a quarter of a second.
    let source = Source { bytes: Cursor::new(ramp(4800)), n: 3200, pause: Duration::from_millis(250) };
    let (samples, facts, _) = taken(source, Some(Instant::now()));
    let spoken: Vec<f32> = samples.iter().copied().filter(|sample| *sample != 0.0).collect();
    let expected: Vec<f32> = (1..4800).map(|i| f32::from(i as i16) / 32_768.0).collect();
    assert!(spoken == expected, "every sample arrives once, in order");
    assert_eq!(samples.len(), facts.n_samples);
    assert!(facts.n_gaps >= 3 && facts.n_silent_samples == samples.len() - 4800, "{facts:?}");
}

#[test]
fn a_rate_that_is_too_low_is_reported() {
    // 20 ms of sound every 45 ms, so that every second piece is silence.
    let source = Source { bytes: Cursor::new(ramp(90 * PIECE)), n: 2 * PIECE, pause: Duration::from_millis(45) };
    let (_, facts, _) = taken(source, Some(Instant::now()));
    assert!(facts.notes.len() == 1 && facts.notes[0].contains("below 16 kHz"), "{facts:?}");
}

#[test]
fn a_microphone_that_stays_behind_catches_up_in_pauses() {
    // 0.6 s of silence at once, then 5 s in real time; a tone in the middle is kept.
    let tone = |i: usize| if (48_000..56_000).contains(&i) { 3000i16 } else { 1 };
    let bytes: Vec<u8> = (0..90_000).flat_map(|i| tone(i).to_le_bytes()).collect();
    let (sound, start) = (LiveSound::default(), Instant::now());
    let reader = sound.clone();
    let reading = thread::spawn(move || {
        let burst = bytes.chunks(4096).take(5).map(|chunk| (chunk, 0.0));
        let steady = bytes[5 * 4096..].chunks(640).zip(1..).map(|(chunk, i)| (chunk, 0.02 * f64::from(i)));
        let mut chunks = burst.chain(steady).map(|(chunk, at)| {
            thread::sleep((start + Duration::from_secs_f64(at)).saturating_duration_since(Instant::now()));
            chunk
        });
        reader.read_pcm(Chunks { next: Box::new(|| chunks.next().map(<[u8]>::to_vec)) });
    });
    let samples: Vec<f32> = sound.pieces(Some(start)).flat_map(Result::unwrap).collect();
    reading.join().unwrap();
    let facts = sound.facts();
    assert!(samples.iter().filter(|sample| **sample > 0.05).count() == 8000, "{facts:?}");
    let skipped = facts.n_skipped_samples as f64 / 16_000.0;
    assert!((0.4..0.7).contains(&skipped) && facts.lag_ms.unwrap().abs() < 150.0, "{facts:?}");
    assert_eq!(facts.n_samples, 90_000 + facts.n_silent_samples - facts.n_skipped_samples, "{facts:?}");
}

/// A source whose reads return the chunks of a function.
struct Chunks<'a> {
    next: Box<dyn FnMut() -> Option<Vec<u8>> + 'a>,
}

impl Read for Chunks<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let chunk = (self.next)().unwrap_or_default();
        buffer[..chunk.len()].copy_from_slice(&chunk);
        Ok(chunk.len())
    }
}

#[test]
fn a_closed_session_ends_its_reader() {
    let sound = LiveSound::default();
    let reader = sound.clone();
    let source = Source { bytes: Cursor::new(ramp(200_000)), n: 4096, pause: Duration::ZERO };
    let reading = thread::spawn(move || reader.read_pcm(source));
    let pieces = sound.pieces(None);
    assert_eq!(pieces.take(3).map(|piece| piece.unwrap().len()).sum::<usize>(), 3 * PIECE);
    // The queue is full: the reader waits, and memory is bounded.
    sound.close();
    reading.join().unwrap();
}
