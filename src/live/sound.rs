//! Speech in real time: a thread reads it into a bounded queue, and the generator takes it in pieces of 20 ms. Sound that
//! does not arrive in time is preceded by silence, so that the motion continues. If a source in real time stays behind
//! for this reason, or because its clock is fast, quiet pieces are skipped.

use anyhow::{Result, bail, ensure};
use orator_base::types::sound::SAMPLE_RATE;
use orator_media::ffmpeg::audio::stream_mono;
use orator_media::sandbox::{FileAccess, restrict_thread};
use serde::Serialize;
use std::collections::VecDeque;
use std::io::Read;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Number of samples per piece, 20 ms.
pub const PIECE: usize = SAMPLE_RATE as usize / 50;
/// Seconds of speech over which a lag is measured, and the lag from which quiet pieces are skipped.
const LAG_SECS: f64 = 2.0;
const MAX_LAG_SECS: f64 = 0.08;
/// Root mean square of a quiet piece, -46 dB.
const QUIET: f32 = 0.005;
/// Time by which pieces are taken late, after the first seconds, if the network is too slow.
const SLOW_SECS: f64 = 0.5;
const FIRST_SECS: usize = 5;
/// Capacity of the queue in samples, 2 s. A writer that is faster than real time waits.
const CAPACITY: usize = 2 * SAMPLE_RATE as usize;
/// Time by which sound may arrive late before silence replaces it.
pub const LATE_LIMIT: Duration = Duration::from_millis(60);
/// Seconds for which the source waits between two gaps before this is reported.
const FULL_SECS: f64 = 20.0;
/// Number of gaps within a time, in seconds, that are reported as sound of a lower rate.
const FREQUENT_GAPS: (usize, f64) = (20, 10.0);
/// Beginnings of sound files, which are not plain samples.
const FILE_STARTS: [&[u8]; 4] = [b"RIFF", b"fLaC", b"OggS", b"ID3"];

/// What happened to the sound of a session.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SoundFacts {
    /// Number of samples of the session, including inserted silence.
    pub n_samples: usize,
    /// Number of times that sound was late, and the number of samples of silence that replaced it.
    pub n_gaps: usize,
    pub n_silent_samples: usize,
    /// Number of quiet samples that were skipped.
    pub n_skipped_samples: usize,
    /// Time in the session of the end of the speech after its time by the clock, ms; only for sound in real time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_ms: Option<f64>,
    /// Notes about the source, each once.
    pub notes: Vec<String>,
}

#[derive(Default)]
struct Queue {
    samples: VecDeque<f32>,
    /// Whether the source has ended; when, and an error that ended it.
    is_complete: bool,
    ended: Option<Instant>,
    error: Option<anyhow::Error>,
    facts: SoundFacts,
    /// Number of samples of the session, once the source has ended and its last sample was taken.
    n_at_end: Option<usize>,
    /// Whether the session has ended, so that the reader can stop.
    is_closed: bool,
    /// Time for which a source in real time had to wait for space.
    full_secs: f64,
    latest_gaps: VecDeque<Instant>,
    is_in_gap: bool,
    /// Start of the session, for sound in real time.
    start: Option<Instant>,
    /// Arrival of the first sample, and time until which a gap goes on after speech has come again.
    first_arrival: Option<Instant>,
    resumes: Option<Instant>,
    lag: LagMeter,
}

/// Measures over [`LAG_SECS`] of speech whether a source in real time stays behind.
#[derive(Default)]
struct LagMeter {
    first: Option<Instant>,
    n_arrived: usize,
    n_waited: usize,
    /// Smallest lag, seconds.
    least: f64,
    /// Number of samples that may be skipped.
    n_behind: usize,
}

impl LagMeter {
    /// Counts `n` samples that arrive now and are used `lag` seconds later than in a session without gaps.
    fn add(&mut self, n: usize, lag: f64, now: Instant) {
        let first = *self.first.get_or_insert(now);
        self.least = if self.n_arrived == 0 { lag } else { self.least.min(lag) };
        self.n_arrived += n;
        if self.n_arrived as f64 >= LAG_SECS * f64::from(SAMPLE_RATE) {
            let speed = secs(self.n_arrived).as_secs_f64() / now.duration_since(first).as_secs_f64().max(1e-3);
            let is_behind = self.n_waited == 0 && (0.8..1.25).contains(&speed) && self.least > MAX_LAG_SECS;
            let n_behind = if is_behind { (self.least * f64::from(SAMPLE_RATE)) as usize } else { 0 };
            *self = Self { n_behind, ..Self::default() };
        }
    }
}

impl Queue {
    fn note_once(&mut self, text: &str) {
        if !self.facts.notes.iter().any(|note| note == text) {
            self.facts.notes.push(text.to_owned());
        }
    }
}

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The speech of a session, shared by the thread that reads it and the one that takes its pieces.
#[derive(Clone, Default)]
pub struct LiveSound {
    shared: Arc<Shared>,
}

impl LiveSound {
    /// Reads 16-bit little-endian mono samples at 16 kHz until the end of `source`.
    pub fn read_pcm(&self, source: impl Read) {
        self.complete(self.pcm(source));
    }

    /// Reads the sound of a file. From now on this thread can open no other file.
    pub fn read_file(&self, path: &Path) {
        let reads = Some(vec![path.canonicalize().unwrap_or_else(|_| path.to_owned())]);
        restrict_thread(&FileAccess { reads, writes: Vec::new() });
        let ended = stream_mono(path, 0, SAMPLE_RATE, &mut |samples| self.push(samples, &mut |_, _| ()));
        self.complete(ended.and_then(|found| match found {
            Some(_) => Ok(()),
            None => bail!("{} has no audio", path.display()),
        }));
    }

    fn complete(&self, ended: Result<()>) {
        let mut queue = self.shared.lock();
        queue.is_complete = true;
        queue.error = ended.err().filter(|_| !queue.is_closed);
        queue.ended = Some(Instant::now());
        self.shared.changed.notify_all();
    }

    fn pcm(&self, mut source: impl Read) -> Result<()> {
        let (mut bytes, mut n_left) = ([0; 4096], 0);
        let mut is_first = true;
        loop {
            let n_read = source.read(&mut bytes[n_left..])?;
            let n = n_left + n_read;
            if n < 4 && is_first && n_read > 0 {
                n_left = n;
                continue;
            }
            let is_file = is_first && FILE_STARTS.iter().any(|start| bytes[..n].starts_with(start));
            ensure!(
                !is_file,
                "standard input is an audio file, expected plain samples (16-bit little-endian, mono, 16 kHz): give the \
                 file with --audio, or convert it with `ffmpeg -i FILE -f s16le -ar 16000 -ac 1 -`"
            );
            is_first = false;
            let samples = bytes[..n].chunks_exact(2).map(|of| f32::from(i16::from_le_bytes([of[0], of[1]])) / 32_768.0);
            self.push(&samples.collect::<Vec<_>>(), &mut note_fast)?;
            n_left = n % 2;
            if n_read == 0 {
                if n_left > 0 {
                    self.shared.lock().note_once("the speech ended within a sample; its last byte is ignored");
                }
                return Ok(());
            }
            bytes.copy_within(n - n_left..n, 0);
        }
    }

    /// Appends samples. While the queue is full it waits, and calls `waited` with the seconds of each wait.
    fn push(&self, samples: &[f32], waited: &mut dyn FnMut(&mut Queue, f64)) -> Result<()> {
        for part in samples.chunks(CAPACITY) {
            let mut queue = self.shared.lock();
            while queue.samples.len() + part.len() > CAPACITY && !queue.is_closed {
                let before = Instant::now();
                queue = self.shared.changed.wait(queue).unwrap_or_else(PoisonError::into_inner);
                queue.lag.n_waited += 1;
                waited(&mut queue, before.elapsed().as_secs_f64());
            }
            ensure!(!queue.is_closed, "the session has ended");
            let now = Instant::now();
            queue.first_arrival.get_or_insert(now);
            if queue.is_in_gap && queue.samples.is_empty() {
                queue.resumes = Some(now + LATE_LIMIT);
            }
            if let Some(start) = queue.start {
                let place = secs(queue.facts.n_samples + queue.samples.len()).as_secs_f64();
                let lag = place - now.saturating_duration_since(start).as_secs_f64();
                queue.lag.add(part.len(), lag, now);
            }
            queue.samples.extend(part);
            self.shared.changed.notify_all();
        }
        Ok(())
    }

    /// Pieces of the speech. With a `start`, the sample n is due at n / 16,000 s after it, and silence replaces what is
    /// not there in time; without one, pieces wait for the source.
    pub fn pieces(&self, start: Option<Instant>) -> impl Iterator<Item = Result<Vec<f32>>> + use<> {
        let shared = self.shared.clone();
        shared.lock().start = start;
        let mut end = 0;
        std::iter::from_fn(move || {
            end += PIECE;
            let due = start.map(|start| start + LATE_LIMIT + secs(end));
            let mut queue = shared.lock();
            let behind = due.map_or(0.0, |due| Instant::now().saturating_duration_since(due).as_secs_f64());
            if behind > SLOW_SECS && end > FIRST_SECS * SAMPLE_RATE as usize && queue.samples.len() > PIECE {
                queue.note_once(
                    "the network is slower than the speech on this machine: train a smaller one (gan.preset)",
                );
                queue.full_secs = 0.0;
            }
            loop {
                skip_quiet(&mut queue);
                let now = Instant::now();
                let is_late = due.is_some_and(|due| now >= due);
                // After a gap, the speech gets its slack again.
                let is_held = queue.is_in_gap && !queue.is_complete && due < queue.resumes;
                if (queue.samples.len() >= PIECE && !is_held) || queue.is_complete || is_late {
                    let piece = take(&mut queue, now, is_held);
                    shared.changed.notify_all();
                    return piece.transpose();
                }
                queue = match due {
                    Some(due) => {
                        shared.changed.wait_timeout(queue, due - now).map_or_else(|e| e.into_inner().0, |w| w.0)
                    }
                    None => shared.changed.wait(queue).unwrap_or_else(PoisonError::into_inner),
                };
            }
        })
    }

    /// Number of samples of the session, once the source has ended and its last sample was taken.
    pub fn n_samples_at_end(&self) -> Option<usize> {
        self.shared.lock().n_at_end
    }

    /// Time at which the first sample arrived.
    pub fn first_arrival(&self) -> Option<Instant> {
        self.shared.lock().first_arrival
    }

    pub fn facts(&self) -> SoundFacts {
        self.shared.lock().facts.clone()
    }

    /// Ends the session: the reader stops, and no further piece waits.
    pub fn close(&self) {
        let mut queue = self.shared.lock();
        queue.is_closed = true;
        queue.is_complete = true;
        self.shared.changed.notify_all();
    }
}

/// Counts a wait of a source that should be in real time.
fn note_fast(queue: &mut Queue, secs: f64) {
    queue.full_secs += secs;
    if queue.full_secs > FULL_SECS {
        queue.note_once(
            "speech arrives faster than 16,000 samples a second: if it comes from a microphone, it has another rate or more \
             channels than expected (16 kHz, mono)",
        );
    }
}

/// The next piece of a queue: full, the rest of a source that has ended, or one completed by silence.
fn take(queue: &mut Queue, now: Instant, is_held: bool) -> Result<Option<Vec<f32>>> {
    let n = if is_held { 0 } else { queue.samples.len().min(PIECE) };
    if n < PIECE && queue.is_complete {
        if let Some(error) = queue.error.take() {
            return Err(error);
        }
        if n == 0 {
            queue.n_at_end = Some(queue.facts.n_samples);
            let by_clock = queue.start.zip(queue.ended).map(|(start, ended)| ended.saturating_duration_since(start));
            let of_samples = secs(queue.facts.n_samples).as_secs_f64();
            queue.facts.lag_ms = by_clock.map(|by_clock| 1e3 * (of_samples - by_clock.as_secs_f64()));
            return Ok(None);
        }
    }
    let mut piece: Vec<f32> = queue.samples.drain(..n).collect();
    let is_gap = n < PIECE && !queue.is_complete;
    if is_gap {
        piece.resize(PIECE, 0.0);
        queue.facts.n_silent_samples += PIECE - n;
        if !queue.is_in_gap {
            queue.facts.n_gaps += 1;
            queue.full_secs = 0.0;
            note_frequent_gaps(queue, now);
        }
    }
    queue.is_in_gap = is_gap;
    queue.facts.n_samples += piece.len();
    Ok(Some(piece))
}

/// Skips quiet pieces at the start of the queue while the speech stays behind.
fn skip_quiet(queue: &mut Queue) {
    while queue.lag.n_behind >= PIECE && queue.samples.len() >= PIECE {
        let power: f32 = queue.samples.iter().take(PIECE).map(|sample| sample * sample).sum();
        if power > QUIET * QUIET * PIECE as f32 {
            return;
        }
        queue.samples.drain(..PIECE);
        queue.facts.n_skipped_samples += PIECE;
        queue.lag.n_behind -= PIECE;
    }
}

fn note_frequent_gaps(queue: &mut Queue, now: Instant) {
    let (n, secs) = FREQUENT_GAPS;
    queue.latest_gaps.push_back(now);
    if queue.latest_gaps.len() > n {
        let first = queue.latest_gaps.pop_front();
        if first.is_some_and(|first| now.duration_since(first).as_secs_f64() < secs) {
            queue.note_once(
                "speech arrives in time only in part, and silence fills the gaps: its rate is below 16 kHz, or its source \
                 is interrupted",
            );
        }
    }
}

/// Duration of a number of samples.
pub fn secs(n_samples: usize) -> Duration {
    Duration::from_secs_f64(n_samples as f64 / f64::from(SAMPLE_RATE))
}
