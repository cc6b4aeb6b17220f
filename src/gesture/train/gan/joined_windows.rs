//! The windows of all speakers of a training as one list.

use super::augment::WindowChange;
use super::windows::{WindowBatch, WindowLoader};
use anyhow::{Context, Result};
use candle_core::Tensor;
use orator_base::types::time::FrameRate;

/// Windows of one speaker behind those of the other.
pub struct JoinedWindows<'d>(Vec<WindowLoader<'d>>);

impl<'d> JoinedWindows<'d> {
    /// Loaders by the numbers of their speakers, one at least.
    pub fn new(loaders: Vec<WindowLoader<'d>>) -> Self {
        Self(loaders)
    }

    /// Number of the windows.
    pub fn len(&self) -> usize {
        self.0.iter().map(WindowLoader::len).sum()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Rate of the poses.
    pub fn fps(&self) -> FrameRate {
        self.0[0].fps()
    }

    /// The windows of these numbers (each below `len`) as one batch, each with its change; `changes` may be empty. The
    /// windows of a batch stand in order of their speakers.
    pub fn batch_changed(&self, which: &[usize], changes: &[WindowChange]) -> Result<WindowBatch> {
        if let [only] = &self.0[..] {
            return only.batch_changed(which, changes);
        }
        let mut first = 0;
        let mut parts = Vec::new();
        for (speaker, loader) in (0u32..).zip(&self.0) {
            let own = |i: &usize| (first..first + loader.len()).contains(i);
            let places: Vec<usize> = (0..which.len()).filter(|n| own(&which[*n])).collect();
            let windows: Vec<usize> = places.iter().map(|n| which[*n] - first).collect();
            let changes: Vec<WindowChange> = places.iter().filter_map(|n| changes.get(*n).cloned()).collect();
            first += loader.len();
            if !windows.is_empty() {
                parts.push(WindowBatch {
                    speakers: vec![speaker; windows.len()],
                    ..loader.batch_changed(&windows, &changes)?
                });
            }
        }
        joined(&parts).context("no window was asked for")
    }
}

fn joined(parts: &[WindowBatch]) -> Result<WindowBatch> {
    let of = |tensor: fn(&WindowBatch) -> &Tensor| Tensor::cat(&parts.iter().map(tensor).collect::<Vec<_>>(), 0);
    Ok(WindowBatch {
        mels: of(|part| &part.mels)?,
        poses: of(|part| &part.poses)?,
        mask: of(|part| &part.mask)?,
        speakers: parts.iter().flat_map(|part| part.speakers.iter().copied()).collect(),
    })
}
