//! Audio of a file as an iterator with constant memory: a thread decodes a few chunks ahead.

use super::audio::stream_mono;
use anyhow::{Result, bail};
use orator_base::types::sound::opposite_phase_note;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Maximum number of samples per chunk, and number of chunks decoded ahead.
const CHUNK: usize = 16_384;
const N_AHEAD: usize = 8;

/// Number of samples of `path` as mono at `rate`, by decoding it, and a note on the mix, if any; `None` without audio.
pub fn n_samples(path: &Path, rate: u32) -> Result<Option<(usize, Option<String>)>> {
    let mut n = 0;
    let streamed = stream_mono(path, 0, rate, &mut |chunk| {
        n += chunk.len();
        Ok(())
    })?;
    Ok(streamed.map(|streamed| (n, opposite_phase_note(streamed.opposite_phase_secs))))
}

/// Audio of a file in chunks of mono samples in -1..1.
pub struct SoundStream {
    chunks: Receiver<Result<Vec<f32>>>,
}

impl SoundStream {
    /// Starts decoding the audio of `path` as mono at `rate`. An error is returned as the last chunk.
    pub fn open(path: &Path, rate: u32) -> Self {
        let (sender, chunks) = sync_channel(N_AHEAD);
        let path = path.to_owned();
        std::thread::spawn(move || decode(&path, rate, &sender));
        Self { chunks }
    }
}

impl Iterator for SoundStream {
    type Item = Result<Vec<f32>>;

    fn next(&mut self) -> Option<Self::Item> {
        self.chunks.recv().ok()
    }
}

fn decode(path: &Path, rate: u32, sender: &SyncSender<Result<Vec<f32>>>) {
    let mut is_disconnected = false;
    let ended = stream_mono(path, 0, rate, &mut |streamed| {
        for chunk in streamed.chunks(CHUNK) {
            if sender.send(Ok(chunk.to_vec())).is_err() {
                is_disconnected = true;
                bail!("the receiver was dropped");
            }
        }
        Ok(())
    });
    if let (Err(error), false) = (ended, is_disconnected) {
        // A dropped receiver needs no error.
        let _ = sender.send(Err(error));
    }
}
