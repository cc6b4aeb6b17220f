//! Entries of the configuration that name files: a path, a folder, or a pattern.

use std::path::{Path, PathBuf};

/// Endings taken for videos when a folder is named.
pub const OF_VIDEOS: [&str; 10] = ["mp4", "mkv", "mov", "webm", "avi", "m4v", "mpg", "mpeg", "ts", "wmv"];
/// Endings taken for sounds, beside those of videos.
pub const OF_SOUNDS: [&str; 8] = ["wav", "mp3", "flac", "ogg", "opus", "m4a", "aac", "wma"];

/// The files an entry names: itself, those of the folder it is that end like one of `endings`, or what its pattern matches.
/// `what` is a word for such a file. A plain path is taken as it is, so that a missing file fails by itself.
pub fn expand(
    entry: &str,
    folder: &Path,
    (what, endings): (&str, &[&str]),
    missing: &mut Vec<String>,
) -> Result<Vec<PathBuf>, String> {
    let path = folder.join(entry);
    if !path.is_dir() {
        return matches(entry, folder, missing);
    }
    let paths: Vec<PathBuf> = list(&path)
        .map_err(|error| format!("{entry}: cannot list the folder: {error}"))?
        .into_iter()
        .filter(|path| has_ending(path, endings))
        .collect();
    let nothing = || format!("{entry}: the folder holds no {what} ({})", endings.join(", "));
    if paths.is_empty() { Err(nothing()) } else { Ok(paths) }
}

/// The file or folder that an entry is, or what its pattern matches. A folder that a pattern could not look into is
/// `missing`.
pub fn matches(entry: &str, folder: &Path, missing: &mut Vec<String>) -> Result<Vec<PathBuf>, String> {
    let path = folder.join(entry);
    if path.exists() || !entry.contains(['*', '?', '[']) {
        return Ok(vec![path]);
    }
    let pattern = Path::new(&glob::Pattern::escape(&folder.to_string_lossy())).join(entry);
    let matches = glob::glob(&pattern.to_string_lossy()).map_err(|error| format!("{entry}: no pattern: {error}"))?;
    let n_missing = missing.len();
    let mut unread = |error: glob::GlobError| missing.push(format!("{entry}: cannot look there: {error}"));
    let paths: Vec<PathBuf> = matches.filter_map(|found| found.map_err(&mut unread).ok()).collect();
    if paths.is_empty() && missing.len() == n_missing {
        Err(format!("{entry}: no file matches, looked in {}", folder.display()))
    } else {
        Ok(paths)
    }
}

/// What lies in a folder, sorted.
pub fn list(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder)?.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.sort();
    Ok(paths)
}

/// Whether a file's name has one of the endings, in small letters or large.
pub fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| endings.contains(&ending.as_str()))
}
