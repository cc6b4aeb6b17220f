//! Transcripts of the sounds of a batch, found by name.

use super::sounds::BatchSound;
use anyhow::{Result, ensure};
use orator_formats::transcript::ENDINGS;
use std::path::{Path, PathBuf};

/// Names the transcript of every sound that names none: called as the motion or the sound in `folder`, or, without a folder,
/// as the sound beside it. A sound may have none.
///
/// # Errors
/// A `folder` that is none, or without a transcript of any of the sounds.
pub fn find(sounds: &mut [BatchSound], folder: Option<&Path>) -> Result<()> {
    if let Some(folder) = folder {
        ensure!(folder.is_dir(), "{} is no folder; for many sounds --transcript is one", folder.display());
    }
    for sound in sounds.iter_mut().filter(|sound| sound.transcript.is_none()) {
        sound.transcript = match folder {
            None => with_ending(&sound.audio.with_extension("")),
            Some(folder) => {
                let stem = sound.audio.file_stem().unwrap_or_default();
                with_ending(&folder.join(&sound.name)).or_else(|| with_ending(&folder.join(stem)))
            }
        };
    }
    if let Some(folder) = folder {
        ensure!(
            sounds.iter().any(|sound| sound.transcript.is_some()),
            "{} holds no transcript with the name of a sound ({})",
            folder.display(),
            ENDINGS.join(", ")
        );
    }
    Ok(())
}

/// The first file with the ending of a transcript behind `path`.
fn with_ending(path: &Path) -> Option<PathBuf> {
    let named = |ending: &&str| PathBuf::from(format!("{}.{ending}", path.display()));
    ENDINGS.iter().map(named).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transcripts_lie_beside_the_sound_or_in_a_folder() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("said/sub")).unwrap();
        for file in ["a.1.srt", "a.srt", "b.json", "b.tsv", "said/b.vtt", "said/sub/c.txt", "own.ctm"] {
            std::fs::write(at(file), "").unwrap();
        }
        let sound = |audio: &str, name: &str, own: Option<&str>| BatchSound {
            audio: at(audio),
            name: name.into(),
            checkpoint: None,
            transcript: own.map(at),
        };
        let rows = [sound("a.1.wav", "a_1_wav", None), sound("b.mp3", "b", None), sound("c.wav", "sub/c", None)];
        let found = |folder: Option<&str>, more: Option<BatchSound>| {
            let mut rows: Vec<BatchSound> = rows.iter().cloned().chain(more).collect();
            find(&mut rows, folder.map(at).as_deref())?;
            anyhow::Ok(rows.into_iter().map(|row| row.transcript).collect::<Vec<_>>())
        };
        assert_eq!(found(None, None).unwrap(), [Some(at("a.1.srt")), Some(at("b.tsv")), None]);
        let own = found(Some("said"), Some(sound("b.mp3", "d", Some("own.ctm")))).unwrap();
        assert_eq!(own, [None, Some(at("said/b.vtt")), Some(at("said/sub/c.txt")), Some(at("own.ctm"))]);
        assert!(found(Some("b.tsv"), None).unwrap_err().to_string().contains("no folder"));
        std::fs::create_dir(at("empty")).unwrap();
        assert!(found(Some("empty"), None).unwrap_err().to_string().contains("holds no transcript"));
    }
}
