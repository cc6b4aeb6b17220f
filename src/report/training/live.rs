//! The page of a training that goes on: written anew behind each validation.

use super::page;
use super::strip::HeldOutPair;
use anyhow::Result;
use orator_gesture::train::epochs::ValidatedStep;
use std::path::{Path, PathBuf};

/// Makes true and generated poses of held-out intervals, with the best checkpoint of a training.
pub type PosesOfBest<'a> = Box<dyn Fn() -> Result<Vec<HeldOutPair>> + 'a>;

/// The page of a training in its folder. Poses are made once for each best checkpoint.
pub struct LivePage<'a> {
    folder: &'a Path,
    speaker: String,
    poses: PosesOfBest<'a>,
    of_best: Option<(usize, Vec<HeldOutPair>)>,
    written: Option<ValidatedStep>,
}

impl<'a> LivePage<'a> {
    /// The page of the training of `speaker` in `folder`, not written yet.
    pub fn new(folder: &'a Path, speaker: String, poses: PosesOfBest<'a>) -> Self {
        Self { folder, speaker, poses, of_best: None, written: None }
    }

    /// The file.
    pub fn path(&self) -> PathBuf {
        self.folder.join(page::PAGE)
    }

    /// Writes the page as it is with this validation, unless it has been written so. Errors name the file.
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
