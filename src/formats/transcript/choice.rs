//! Choice among the files that may be the transcript of a recording, such as the words of an aligner beside the JSON of
//! a face tracker.

use super::Transcript;
use anyhow::Result;
use std::path::{Path, PathBuf};

/// Result of reading several files that have the name of a recording.
#[derive(Clone, Debug, Default)]
pub struct TranscriptChoice {
    pub found: Option<(PathBuf, Transcript)>,
    /// Why files were passed over, without their folders; one sentence each.
    pub notes: Vec<String>,
    /// Number of files that were read.
    pub n_read: usize,
}

impl TranscriptChoice {
    /// The first of `paths` with words that have times and that `check` accepts, or else the first that can be read.
    /// `speaker` selects the words in a file of several speakers.
    pub fn first(paths: &[PathBuf], speaker: &str, check: impl Fn(&Path, &Transcript) -> Result<()>) -> Self {
        let mut choice = Self::default();
        for path in paths {
            choice.n_read += 1;
            let read = Transcript::of_speaker(path, speaker);
            match read.and_then(|transcript| check(path, &transcript).map(|()| transcript)) {
                Ok(transcript) if !transcript.words.is_empty() => {
                    choice.found = Some((path.clone(), transcript));
                    break;
                }
                Ok(transcript) => _ = choice.found.get_or_insert_with(|| (path.clone(), transcript)),
                Err(error) => choice.notes.push(without_folder(path, &error)),
            }
        }
        if let (Some((path, _)), false) = (&choice.found, choice.notes.is_empty()) {
            choice.notes.push(format!("{} was read instead", path.file_name().unwrap_or_default().display()));
        }
        choice
    }
}

/// Message of an error; local folder names must not end up in a dataset.
fn without_folder(path: &Path, error: &anyhow::Error) -> String {
    let folder = path.parent().map(|folder| format!("{}/", folder.display())).filter(|folder| folder != "/");
    folder.iter().fold(format!("{error:#}"), |text, folder| text.replace(folder, ""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_usable_file_is_chosen() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = dir.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let tracker = write("a.json", r#"{"names": ["jawOpen"], "frames": [{"weights": [0.5], "time": 0.1}]}"#);
        let (plain, timed) = (write("a.txt", "so"), write("a.tsv", "0\t1\tso\n"));
        let late = write("a.ctm", "a 1 90 1 so\n");
        let check = |_: &Path, transcript: &Transcript| {
            anyhow::ensure!(transcript.words.iter().all(|word| word.start_secs < 9.0), "late");
            Ok(())
        };
        let choose = |paths: &[&PathBuf]| {
            let paths: Vec<PathBuf> = paths.iter().map(|path| (*path).clone()).collect();
            let TranscriptChoice { found, notes, n_read } = TranscriptChoice::first(&paths, "", check);
            (found.map(|(path, _)| path), notes, n_read)
        };
        let (found, notes, n_read) = choose(&[&tracker, &late, &plain, &timed, &plain]);
        assert_eq!((found, n_read, notes.len()), (Some(timed.clone()), 4, 3));
        assert!(notes[0].starts_with("a.json is not a valid transcript: expected `words`"), "{notes:?}");
        assert_eq!(notes[1..], ["late", "a.tsv was read instead"]);
        assert_eq!(choose(&[&plain, &tracker]).0, Some(plain.clone()));
        assert_eq!(choose(&[&timed, &tracker]), (Some(timed.clone()), Vec::new(), 1));
        assert_eq!((choose(&[&tracker]).0, choose(&[]).2), (None, 0));
    }
}
