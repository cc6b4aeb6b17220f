//! Files of a study folder: what participants can reach lies below `public/`, everything else beside it.

use std::path::{Path, PathBuf};

/// Folder of a built study.
#[derive(Clone, Debug)]
pub struct StudyFolder(PathBuf);

impl StudyFolder {
    pub fn new(dir: impl Into<PathBuf>) -> Self {
        Self(dir.into())
    }

    pub fn dir(&self) -> &Path {
        &self.0
    }

    /// Study file with every default written out.
    pub fn study_file(&self) -> PathBuf {
        self.0.join("study.toml")
    }

    /// What each participant sees, [`super::plan::StudyPlan`].
    pub fn plan(&self) -> PathBuf {
        self.0.join("plan.json")
    }

    /// What each film shows, [`super::plan::StudyKey`].
    pub fn key(&self) -> PathBuf {
        self.0.join("key.json")
    }

    /// Hypotheses, exclusion rules and analysis, fixed before the first participant.
    pub fn preregistration(&self) -> PathBuf {
        self.0.join("preregistration.json")
    }

    /// BLAKE3 hash of each file above and of each film, and one over all.
    pub fn seal(&self) -> PathBuf {
        self.0.join("seal.json")
    }

    /// The only folder that participants can reach.
    pub fn public(&self) -> PathBuf {
        self.0.join("public")
    }

    /// Film by its opaque name, 16 hexadecimal digits.
    pub fn film(&self, film: &str) -> PathBuf {
        self.public().join("films").join(format!("{film}.mp4"))
    }

    /// Responses, an SQLite database; written by `serve`, not sealed.
    pub fn responses(&self) -> PathBuf {
        self.0.join("responses.sqlite")
    }

    /// Key that signs participants' tokens and the operator's token, readable by its owner alone; written by `serve`.
    pub fn secret(&self) -> PathBuf {
        self.0.join("secret.json")
    }
}
