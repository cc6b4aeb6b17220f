//! File names that a file contains, for instance names of other files.

use serde::{Deserialize, Serialize};
use std::borrow::Borrow;
use std::fmt;
use std::ops::Deref;

/// Maximum length of a name in bytes, the limit of common file systems.
const MAX_BYTES: usize = 255;

/// Name of one file or folder within its folder: 1 to 255 bytes, no separator (`/` or `\`), no leading dot, no control
/// character. Joining such a name to a folder never leaves the folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String")]
pub struct FileName(String);

/// Error: the text is not a [`FileName`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("invalid file name {0:?}: expected 1 to {MAX_BYTES} bytes, no leading dot, no / or \\, no control characters")]
pub struct FileNameError(String);

impl FileName {
    pub fn new(name: impl Into<String>) -> Result<Self, FileNameError> {
        let name = name.into();
        let is_plain = (1..=MAX_BYTES).contains(&name.len())
            && !name.starts_with('.')
            && !name.contains(|letter: char| matches!(letter, '/' | '\\') || letter.is_control());
        // Truncated, because the error prints the name, which may be very long.
        if is_plain { Ok(Self(name)) } else { Err(FileNameError(name.chars().take(MAX_BYTES).collect())) }
    }
}

impl TryFrom<String> for FileName {
    type Error = FileNameError;

    fn try_from(name: String) -> Result<Self, FileNameError> {
        Self::new(name)
    }
}

impl Deref for FileName {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl Borrow<str> for FileName {
    fn borrow(&self) -> &str {
        &self.0
    }
}

impl AsRef<std::path::Path> for FileName {
    fn as_ref(&self) -> &std::path::Path {
        self.0.as_ref()
    }
}

impl PartialEq<str> for FileName {
    fn eq(&self, other: &str) -> bool {
        self.0 == other
    }
}

impl PartialEq<String> for FileName {
    fn eq(&self, other: &String) -> bool {
        self.0 == *other
    }
}

impl fmt::Display for FileName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
