//! Expansion of configuration entries that name files: a path, a folder, or a glob pattern.

use orator_base::text::{composed, decomposed};
use orator_formats::search;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Folder in which entries are searched.
#[derive(Clone, Debug)]
pub struct SearchRoot {
    /// Folder that relative entries refer to.
    pub folder: PathBuf,
    /// Canonical paths of the folders that the program writes to; patterns do not match files in them.
    own: Vec<PathBuf>,
}

impl SearchRoot {
    /// Search root `folder`. Patterns skip the folders `own`, except one that contains `folder` itself.
    pub fn new(folder: &Path, own: &[&Path]) -> Self {
        let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let own = own.iter().map(|path| real(path)).filter(|path| !real(folder).starts_with(path)).collect();
        Self { folder: folder.to_owned(), own }
    }

    fn is_own(&self, path: &Path) -> bool {
        let real = || path.canonicalize().unwrap_or_else(|_| path.to_owned());
        !self.own.is_empty() && {
            let path = real();
            self.own.iter().any(|own| path.starts_with(own))
        }
    }
}

/// Extensions of video files that are used from a folder.
pub const VIDEO_EXTENSIONS: [&str; 19] = [
    "mp4", "mkv", "mov", "webm", "avi", "m4v", "mpg", "mpeg", "ts", "wmv", "mts", "m2ts", "m2t", "vob", "mxf", "flv",
    "3gp", "asf", "ogv",
];
/// Extensions of sound files; the sound of video files can be used too.
pub const SOUND_EXTENSIONS: [&str; 12] =
    ["wav", "flac", "mp3", "m4a", "ogg", "opus", "aac", "oga", "aif", "aiff", "wma", "caf"];

/// Extensions of transcript files.
pub const TRANSCRIPT_EXTENSIONS: [&str; 7] = ["json", "srt", "vtt", "textgrid", "ctm", "tsv", "txt"];

/// Patterns match in any case, since cameras write endings such as `.MP4`.
pub const ANY_CASE: glob::MatchOptions =
    glob::MatchOptions { case_sensitive: false, require_literal_separator: false, require_literal_leading_dot: false };

/// Maximum nesting depth of folders that `**` enters.
const MAX_DEPTH: usize = 64;

/// Files that an entry names: the files with one of `extensions` in a folder, the matches of a pattern, or a plain
/// path, which is returned even if it does not exist, so that the error is reported for that file. `what` names the
/// kind of file in messages.
pub fn expand(
    entry: &str,
    root: &SearchRoot,
    (what, extensions): (&str, &[&str]),
    missing: &mut Vec<String>,
) -> Result<Vec<PathBuf>, String> {
    let path = search::existing(&root.folder.join(entry));
    if !path.is_dir() {
        return matches(entry, root, missing);
    }
    let paths: Vec<PathBuf> = list(&path)
        .map_err(|error| format!("{entry}: cannot list the folder: {error}"))?
        .into_iter()
        .filter(|path| has_extension(path, extensions))
        .collect();
    let nothing = || format!("{entry}: the folder contains no {what}: expected {}", extensions.join(", "));
    if paths.is_empty() { Err(nothing()) } else { Ok(paths) }
}

/// Files and folders that an entry names: a plain path, or the matches of a pattern in any case, without files that the
/// program itself wrote. Accented letters may be composed or not. Messages about unreadable folders and file names that
/// are not UTF-8 are added to `missing`.
pub fn matches(entry: &str, root: &SearchRoot, missing: &mut Vec<String>) -> Result<Vec<PathBuf>, String> {
    let folder = &root.folder;
    let path = search::existing(&folder.join(entry));
    if path.exists() || !entry.contains(['*', '?', '[']) {
        return Ok(vec![path]);
    }
    let n_missing = missing.len();
    let mut found = |folders: &[PathBuf], pattern: &str| -> Result<Vec<PathBuf>, String> {
        let mut paths = Vec::new();
        let forms = BTreeSet::from([pattern.to_owned(), composed(pattern), decomposed(pattern)]);
        for (folder, pattern) in folders.iter().flat_map(|folder| forms.iter().map(move |form| (folder, form))) {
            let pattern = Path::new(&glob::Pattern::escape(&folder.to_string_lossy())).join(pattern);
            let matches = glob::glob_with(&pattern.to_string_lossy(), ANY_CASE)
                .map_err(|error| format!("{entry}: no pattern: {error}"))?;
            let mut report_unreadable =
                |error: glob::GlobError| missing.push(format!("{entry}: cannot read the folder: {error}"));
            paths.extend(matches.filter_map(|found| found.map_err(&mut report_unreadable).ok()));
        }
        Ok(paths)
    };
    // `**` is expanded here, since `glob` would follow circular links without end.
    let (mut folders, mut rest) = (vec![folder.to_owned()], entry);
    while let Some((before, after)) =
        rest.split_once("**/").filter(|(before, _)| before.is_empty() || before.ends_with('/'))
    {
        let tops = if before.is_empty() { folders } else { found(&folders, before)? };
        folders = Vec::new();
        let mut visited = BTreeSet::new();
        tops.iter().for_each(|top| add_below(top, MAX_DEPTH, &mut visited, &mut folders));
        rest = after;
    }
    let mut paths = found(&folders, rest)?;
    paths.retain(|path| !root.is_own(path));
    let non_utf8 = folders.iter().flat_map(|folder| non_utf8_files(rest, folder));
    missing.extend(non_utf8.filter(|path| !root.is_own(path)).map(|path| not_utf8_message(&path)));
    if paths.is_empty() && missing.len() == n_missing {
        Err(format!("{entry}: no matching file in {}", folder.display()))
    } else {
        Ok(paths)
    }
}

/// Adds `folder` and all folders below it, including hidden ones; a folder that is reachable by several links is added
/// once.
fn add_below(folder: &Path, depth: usize, visited: &mut BTreeSet<PathBuf>, folders: &mut Vec<PathBuf>) {
    let is_new = folder.canonicalize().is_ok_and(|path| path.is_dir() && visited.insert(path));
    if is_new && depth > 0 {
        folders.push(folder.to_owned());
        // A folder that cannot be listed is reported when its files are matched.
        list(folder).unwrap_or_default().iter().for_each(|path| add_below(path, depth - 1, visited, folders));
    }
}

/// Files whose names are not UTF-8 and would match the last part of the pattern; only the folder before its first
/// wildcard is searched. `glob` never matches such files.
fn non_utf8_files(entry: &str, folder: &Path) -> Vec<PathBuf> {
    let parts: Vec<&str> = entry.split('/').collect();
    let n_plain = parts.iter().take_while(|part| !part.contains(['*', '?', '['])).count();
    let start_folder = parts[..n_plain].iter().fold(folder.to_owned(), |folder, part| folder.join(part));
    let last = parts.last().and_then(|last| glob::Pattern::new(last).ok());
    let matches = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default();
        name.to_str().is_none() && last.as_ref().is_some_and(|last| last.matches(&name.to_string_lossy()))
    };
    list(&start_folder).unwrap_or_default().into_iter().filter(matches).collect()
}

/// Message for a path that is not valid UTF-8.
pub fn not_utf8_message(path: &Path) -> String {
    format!("{}: the file name is not valid UTF-8: rename it", path.display())
}

/// Sorted paths of the entries of a folder.
pub fn list(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder)?.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.sort();
    Ok(paths)
}

/// Whether a path has one of the extensions (given in lower case), ignoring case.
pub fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| extensions.contains(&ending.as_str()))
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn names_match_in_any_case_and_any_form_of_accents() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        ["A1.MP4", "e\u{301}te\u{301}.mp4", "C0001.MTS"].iter().for_each(|name| std::fs::write(at(name), "").unwrap());
        let root = SearchRoot::new(dir.path(), &[]);
        let found = |entry: &str| expand(entry, &root, ("video", &VIDEO_EXTENSIONS), &mut Vec::new()).unwrap();
        assert_eq!(found("*.mp4"), [at("A1.MP4"), at("e\u{301}te\u{301}.mp4")]);
        for entry in ["\u{e9}t\u{e9}.mp4", "\u{e9}*.mp4", "e\u{301}te\u{301}.mp4"] {
            assert_eq!(found(entry), [at("e\u{301}te\u{301}.mp4")], "{entry}");
        }
        assert_eq!(found(".").len(), 3);
    }

    #[test]
    fn folders_with_circular_links_are_searched_once() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("a/b/c")).unwrap();
        ["a/b/c/1.mp4", "a/2.mp4", "3.mp4"].iter().for_each(|name| std::fs::write(at(name), "").unwrap());
        symlink(".", at("one")).unwrap();
        symlink(".", at("two")).unwrap();
        let found = |entry: &str| {
            let mut paths = matches(entry, &SearchRoot::new(dir.path(), &[]), &mut Vec::new())?;
            paths.sort();
            Ok::<_, String>(paths)
        };
        assert_eq!(found("**/*.mp4").unwrap(), [at("3.mp4"), at("a/2.mp4"), at("a/b/c/1.mp4")]);
        assert_eq!(found("a/**/c/*.mp4").unwrap(), [at("a/b/c/1.mp4")]);
        assert_eq!(found("*/b/**/1.mp4").unwrap(), [at("a/b/c/1.mp4")]);
        assert!(found("a**/*.mp4").unwrap_err().contains("no pattern"));
        assert!(found("**/*.mkv").unwrap_err().contains("no matching file"));
    }
}
