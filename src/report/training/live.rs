//! Page of a running training: it is written again after each validation.

use super::page;
use super::strip::HeldOutPair;
use anyhow::Result;
use orator_gesture::train::epochs::ValidatedStep;
use std::path::{Path, PathBuf};

/// Function that generates poses of held-out intervals with the best checkpoint, paired with the true ones.
pub type BestPosesFn<'a> = Box<dyn Fn() -> Result<Vec<HeldOutPair>> + 'a>;

/// Page in the folder of a running training. Poses are generated once per best checkpoint.
pub struct LivePage<'a> {
    folder: &'a Path,
    speaker: String,
    poses: BestPosesFn<'a>,
    of_best: Option<(usize, Vec<HeldOutPair>)>,
    written: Option<ValidatedStep>,
}

impl<'a> LivePage<'a> {
    /// Page of the training of `speaker` in `folder`; nothing is written yet.
    pub fn new(folder: &'a Path, speaker: String, poses: BestPosesFn<'a>) -> Self {
        Self { folder, speaker, poses, of_best: None, written: None }
    }

    /// Path of the page.
    pub fn path(&self) -> PathBuf {
        self.folder.join(page::PAGE)
    }

    /// Writes the page after the validation `at`, unless it has already been written for it.
    ///
    /// # Errors
    /// Failed generation of poses, or a page that cannot be written.
    pub fn write(&mut self, at: ValidatedStep) -> Result<()> {
        if self.written == Some(at) {
            return Ok(());
        }
        if self.of_best.as_ref().is_none_or(|(step, _)| *step != at.best_step) {
            self.of_best = Some((at.best_step, (self.poses)()?));
        }
        let pairs = self.of_best.as_ref().map_or(&[][..], |(_, pairs)| pairs);
        page::write(self.folder, &self.speaker, pairs)?;
        self.written = Some(at);
        Ok(())
    }
}
