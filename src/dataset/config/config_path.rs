//! A path in the configuration.

use serde::{Deserialize, Serialize};
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// A path: as written at first, absolute once the configuration is resolved; empty where none is given.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "WrittenPath", into = "PathBuf")]
pub struct ConfigPath(PathBuf);

/// A path alone, or with the folder it counts from: the second form, which no other setting takes, tells paths from texts.
#[derive(Deserialize)]
#[serde(untagged)]
enum WrittenPath {
    Alone(PathBuf),
    Within { folder: PathBuf, path: PathBuf },
}

impl From<WrittenPath> for ConfigPath {
    fn from(written: WrittenPath) -> Self {
        match written {
            WrittenPath::Alone(path) => Self(path),
            WrittenPath::Within { folder, path } => Self(folder.join(path)),
        }
    }
}

impl Deref for ConfigPath {
    type Target = Path;
    fn deref(&self) -> &Path {
        &self.0
    }
}

impl AsRef<Path> for ConfigPath {
    fn as_ref(&self) -> &Path {
        &self.0
    }
}

impl From<ConfigPath> for PathBuf {
    fn from(path: ConfigPath) -> Self {
        path.0
    }
}

impl From<PathBuf> for ConfigPath {
    fn from(path: PathBuf) -> Self {
        Self(path)
    }
}

impl From<&str> for ConfigPath {
    fn from(path: &str) -> Self {
        Self(path.into())
    }
}
