//! The files that workers read for a unit (a video, or keypoints and their audio), recorded in the plan with their
//! content. A unit is processed only while its files match the plan.

use anyhow::{Result, ensure};
use orator_base::stage::Input;
use orator_base::stage::fingerprint::{HashCache, KnownHash};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A file or folder of a unit, as it was when the plan was written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SealedInput {
    pub role: String,
    pub path: PathBuf,
    #[serde(flatten)]
    pub content: KnownHash,
}

impl SealedInput {
    /// Records the input; hashes its content unless the hash is cached.
    pub fn new(input: Input, hashes: &HashCache) -> Result<Self> {
        let content = hashes.content(&input.path)?;
        Ok(Self { role: input.role, path: input.path, content })
    }

    /// Checks that the content is that of the plan; a new modification time alone is ignored.
    ///
    /// # Errors
    /// The content differs or cannot be read.
    pub fn check(&self, hashes: &HashCache) -> Result<()> {
        ensure!(
            hashes.is_unchanged(&self.path, &self.content)?,
            "{} changed since the plan was written: create the plan again with `orator plan`, or restore the {} and run \
             `orator work --retry`",
            self.path.display(),
            self.role
        );
        Ok(())
    }
}
