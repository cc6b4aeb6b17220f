//! `sound_offset.json`: delay of the audio of a video relative to its images.

use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::types::sound::SoundOffset;
use std::io::ErrorKind;
use std::path::Path;

/// Reads the file; `None` if it does not exist.
///
/// # Errors
///
/// The file is unreadable, not in the format of the segment stage, or has an offset of 60 s or more.
pub fn read(path: &Path) -> Result<Option<SoundOffset>> {
    let bytes = match input::read(path, input::MAX_TEXT) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error).with_context(|| format!("cannot read {}", path.display())),
    };
    let offset: SoundOffset = serde_json::from_slice(&bytes)
        .with_context(|| format!("{} is damaged or not written by the segment stage", path.display()))?;
    ensure!(
        offset.secs.abs() < 60.0,
        "{}: invalid offset {:.3} s: expected less than 60 s",
        path.display(),
        offset.secs
    );
    Ok(Some(offset))
}
