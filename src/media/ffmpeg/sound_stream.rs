//! Sound of a file as a pull stream in constant memory: a thread decodes a few pieces ahead.

use super::audio::stream_mono;
use anyhow::{Result, bail};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Largest number of samples of a piece, and number of pieces decoded ahead.
const PIECE: usize = 16_384;
const AHEAD: usize = 8;

/// Number of samples of the sound of `path` as mono at `rate`, by decoding all of it; `None` without sound.
pub fn n_samples(path: &Path, rate: u32) -> Result<Option<usize>> {
    let mut n = 0;
    let streamed = stream_mono(path, 0, rate, &mut |piece| {
        n += piece.len();
        Ok(())
    })?;
    Ok(streamed.map(|_| n))
}

/// Sound of a file in pieces: mono samples in -1..1.
pub struct SoundStream {
    pieces: Receiver<Result<Vec<f32>>>,
}

impl SoundStream {
    /// Begins to decode the sound of `path` as mono at `rate`. An error comes as the last piece.
    pub fn open(path: &Path, rate: u32) -> Self {
        let (sender, pieces) = sync_channel(AHEAD);
        let path = path.to_owned();
        std::thread::spawn(move || decode(&path, rate, &sender));
        Self { pieces }
    }
}

impl Iterator for SoundStream {
    type Item = Result<Vec<f32>>;

    fn next(&mut self) -> Option<Self::Item> {
        self.pieces.recv().ok()
    }
}

fn decode(path: &Path, rate: u32, sender: &SyncSender<Result<Vec<f32>>>) {
    let mut has_left = false;
    let ended = stream_mono(path, 0, rate, &mut |streamed| {
        for piece in streamed.chunks(PIECE) {
            if sender.send(Ok(piece.to_vec())).is_err() {
                has_left = true;
                bail!("nobody listens any more");
            }
        }
        Ok(())
    });
    if let (Err(error), false) = (ended, has_left) {
        // A receiver that is gone needs no error.
        let _ = sender.send(Err(error));
    }
}
