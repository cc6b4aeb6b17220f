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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transcripts_are_found_next_to_the_sound_or_in_a_folder() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("said/sub")).unwrap();
        for file in ["a.1.SRT", "a.srt", "b.json", "b.tsv", "said/b.vtt", "said/sub/c.txt", "own.ctm"] {
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
        assert_eq!(found(None, None).unwrap(), [Some(at("a.1.SRT")), Some(at("b.tsv")), None]);
        let own = found(Some("said"), Some(sound("b.mp3", "d", Some("own.ctm")))).unwrap();
        assert_eq!(own, [None, Some(at("said/b.vtt")), Some(at("said/sub/c.txt")), Some(at("own.ctm"))]);
        // The JSON of a face tracker beside the words of an aligner.
        std::fs::write(at("c.json"), r#"{"names": ["jawOpen"], "frames": []}"#).unwrap();
        std::fs::write(at("c.ctm"), "c 1 0 1 so\n").unwrap();
        assert_eq!(found(None, None).unwrap()[2], Some(at("c.ctm")));
        assert!(found(Some("b.tsv"), None).unwrap_err().to_string().contains("not a folder"));
        std::fs::create_dir(at("empty")).unwrap();
        assert!(found(Some("empty"), None).unwrap_err().to_string().contains("no transcript in"));
    }
}
