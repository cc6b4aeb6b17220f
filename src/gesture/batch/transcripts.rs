//! Search for the transcripts of the sounds of a batch by name.

use super::sounds::BatchSound;
use anyhow::{Result, ensure};
use orator_formats::search::NamedFiles;
use orator_formats::transcript::{ENDINGS, TranscriptChoice};
use std::path::{Path, PathBuf};

/// Finds the transcript of every sound without one: in `folder`, with the name of the motion or of the sound, or else
/// next to the sound with its name. A sound may have no transcript.
///
/// # Errors
/// A `folder` that is not a folder, or that has no transcript for any of the sounds.
pub fn find(sounds: &mut [BatchSound], folder: Option<&Path>) -> Result<()> {
    if let Some(folder) = folder {
        ensure!(
            folder.is_dir(),
            "{} is not a folder: expected a folder of transcripts for a batch (--transcript)",
            folder.display()
        );
    }
    let mut named = NamedFiles::default();
    for sound in sounds.iter_mut().filter(|sound| sound.transcript.is_none()) {
        sound.transcript = match folder {
            None => with_transcript_extension(&sound.audio.with_extension(""), &mut named),
            Some(folder) => {
                let stem = sound.audio.file_stem().unwrap_or_default();
                with_transcript_extension(&folder.join(&sound.name), &mut named)
                    .or_else(|| with_transcript_extension(&folder.join(stem), &mut named))
            }
        };
    }
    if let Some(folder) = folder {
        ensure!(
            sounds.iter().any(|sound| sound.transcript.is_some()),
            "no transcript in {} is named like an audio file: expected {}",
            folder.display(),
            ENDINGS.join(", ")
        );
    }
    Ok(())
}

/// Existing file `path` with a transcript extension appended: of several the first usable one, or else the first one.
fn with_transcript_extension(path: &Path, named: &mut NamedFiles) -> Option<PathBuf> {
    let stem = path.file_name()?.to_str()?;
    let existing = named.find(path.parent()?, &[stem], &ENDINGS);
    if existing.len() > 1
        && let Some((path, _)) = TranscriptChoice::first(&existing, "", |_, _| Ok(())).found
    {
        return Some(path);
    }
    existing.into_iter().next()
}
