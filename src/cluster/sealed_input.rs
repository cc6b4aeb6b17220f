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

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{self, File};
    use std::time::{Duration, SystemTime};

    #[test]
    fn a_changed_video_is_reported_and_a_touched_one_accepted() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.mp4");
        let hashes = HashCache::open(&dir.path().join("hashes.json"));
        let write = |text: &str, secs_ago: u64| {
            fs::write(&path, text).unwrap();
            File::open(&path).unwrap().set_modified(SystemTime::now() - Duration::from_secs(secs_ago)).unwrap();
        };
        write("planned", 100);
        let sealed = SealedInput::new(Input { role: "video".into(), path: path.clone() }, &hashes).unwrap();
        let json = serde_json::to_string(&sealed).unwrap();
        assert_eq!(serde_json::from_str::<SealedInput>(&json).unwrap(), sealed);
        let check = || sealed.check(&hashes).map_err(|error| format!("{error:#}"));
        assert_eq!(check(), Ok(()));
        write("planned", 50);
        assert_eq!(check(), Ok(()), "a time alone is no change");
        for (text, secs_ago) in [("changed", 40), ("longer than planned", 100)] {
            write(text, secs_ago);
            let error = check().unwrap_err();
            assert!(error.contains("a.mp4 changed since the plan") && error.contains("orator plan"), "{error}");
        }
        write("planned", 10);
        assert_eq!(check(), Ok(()));
        fs::remove_file(&path).unwrap();
        assert!(check().unwrap_err().contains("a.mp4"));
    }
}
