//! Decoding beside other work: one thread reads a video's frames, another works on them, a few frames apart. What comes
//! out is what one thread alone would give.

use super::frames::{FrameReader, FrameTime};
use anyhow::Result;
use std::sync::mpsc;

/// Frames that may wait for the work.
const WAITING: usize = 3;

/// Reads all frames of `reader` in a thread of their own, where `pick` takes of each what is needed (its picture, or
/// nothing), and gives that to `work`, in order. Memory: five picks.
///
/// # Errors
/// The first of `reader`, `pick` or `work`.
pub fn for_each<T: Send>(
    mut reader: FrameReader,
    mut pick: impl FnMut(&mut FrameReader, FrameTime) -> Result<T> + Send,
    mut work: impl FnMut(FrameTime, T) -> Result<()>,
) -> Result<()> {
    std::thread::scope(|scope| {
        let (sender, picks) = mpsc::sync_channel(WAITING);
        scope.spawn(move || {
            loop {
                let next = reader.advance().and_then(|time| {
                    let Some(time) = time else { return Ok(None) };
                    Ok(Some((time, pick(&mut reader, time)?)))
                });
                let Some(next) = next.transpose() else { break };
                let has_failed = next.is_err();
                // Nobody listens any more where the work has failed.
                if sender.send(next).is_err() || has_failed {
                    break;
                }
            }
        });
        picks.into_iter().try_for_each(|next| next.and_then(|(time, picked)| work(time, picked)))
    })
}
