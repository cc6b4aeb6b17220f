//! Decoding in parallel with other work: one thread reads a video's frames, another processes them. Results equal those
//! of one thread.

use super::frames::{FrameReader, FrameTime};
use anyhow::Result;
use std::sync::mpsc;

/// Number of frames that may wait.
const WAITING: usize = 3;

/// Reads all frames of `reader` in a thread, where `pick` selects what is needed of each, and passes the selections to
/// `work` in order. Memory: five selections.
///
/// # Errors
/// The first error of `reader`, `pick` or `work`.
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
                // The receiver is gone once the work has failed.
                if sender.send(next).is_err() || has_failed {
                    break;
                }
            }
        });
        picks.into_iter().try_for_each(|next| next.and_then(|(time, picked)| work(time, picked)))
    })
}
