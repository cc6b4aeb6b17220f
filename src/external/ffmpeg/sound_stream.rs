//! The sound of a file as a stream that is asked for its pieces, so that a sound of hours takes no memory: it is decoded
//! beside the asker's work, a few pieces ahead.

use super::audio::stream_mono;
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Samples of a piece at most, and pieces that are decoded ahead.
const PIECE: usize = 16_384;
const AHEAD: usize = 8;

/// Samples that the sound of `path` has as mono at `rate`: all of it is decoded once. `None` when it has no sound.
pub fn n_samples(path: &Path, rate: u32) -> Result<Option<usize>> {
    let mut n = 0;
    let heard = stream_mono(path, rate, &mut |piece| {
        n += piece.len();
        Ok(())
    })?;
    Ok(heard.map(|_| n))
}

/// The sound of a file, piece by piece: mono samples in -1..1.
pub struct SoundStream {
    pieces: Receiver<Result<Vec<f32>>>,
}

impl SoundStream {
    /// Begins to decode the sound of `path` as mono at `rate`. What goes wrong comes as the last piece.
    pub fn open(path: &Path, rate: u32) -> Self {
        let (sender, pieces) = sync_channel(AHEAD);
        let path = path.to_owned();
        std::thread::spawn(move || decode(path, rate, &sender));
        Self { pieces }
    }
}

impl Iterator for SoundStream {
    type Item = Result<Vec<f32>>;

    fn next(&mut self) -> Option<Self::Item> {
        self.pieces.recv().ok()
    }
}

fn decode(path: PathBuf, rate: u32, sender: &SyncSender<Result<Vec<f32>>>) {
    let mut has_left = false;
    let ended = stream_mono(&path, rate, &mut |heard| {
        for piece in heard.chunks(PIECE) {
            if sender.send(Ok(piece.to_vec())).is_err() {
                has_left = true;
                bail!("nobody listens any more");
            }
        }
        Ok(())
    });
    if let (Err(error), false) = (ended, has_left) {
        // that nobody waits for the error is no further trouble
        let _ = sender.send(Err(error));
    }
}
