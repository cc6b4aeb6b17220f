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
