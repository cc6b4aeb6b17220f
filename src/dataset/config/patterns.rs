//! Entries of the configuration that name files: a path, a folder, or a pattern.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Where entries are looked for.
#[derive(Clone, Debug)]
pub struct SearchRoot {
    /// The folder that they count from.
    pub folder: PathBuf,
    /// Folders that the program writes in: patterns pass them over.
    own: Vec<PathBuf>,
}

impl SearchRoot {
    /// Entries of `folder`; a folder in `own` that everything lies in is not passed over.
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

/// Endings taken for videos when a folder is named.
pub const OF_VIDEOS: [&str; 10] = ["mp4", "mkv", "mov", "webm", "avi", "m4v", "mpg", "mpeg", "ts", "wmv"];
/// Endings taken for sounds, beside those of videos.
pub const OF_SOUNDS: [&str; 12] =
    ["wav", "flac", "mp3", "m4a", "ogg", "opus", "aac", "oga", "aif", "aiff", "wma", "caf"];

/// Endings taken for transcripts.
pub const OF_TRANSCRIPTS: [&str; 7] = ["json", "srt", "vtt", "textgrid", "ctm", "tsv", "txt"];

/// Most folders within each other that `**` looks into.
const MAX_DEPTH: usize = 64;

/// The files an entry names: itself, those of the folder it is that end like one of `endings`, or what its pattern matches.
/// `what` is a word for such a file. A plain path is taken as it is, so that a missing file fails by itself.
pub fn expand(
    entry: &str,
    root: &SearchRoot,
    (what, endings): (&str, &[&str]),
    missing: &mut Vec<String>,
) -> Result<Vec<PathBuf>, String> {
    let path = root.folder.join(entry);
    if !path.is_dir() {
        return matches(entry, root, missing);
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
/// `missing`, and so is a file whose name is no text. What the program itself wrote matches no pattern.
pub fn matches(entry: &str, root: &SearchRoot, missing: &mut Vec<String>) -> Result<Vec<PathBuf>, String> {
    let folder = &root.folder;
    let path = folder.join(entry);
    if path.exists() || !entry.contains(['*', '?', '[']) {
        return Ok(vec![path]);
    }
    let n_missing = missing.len();
    let mut found = |folders: &[PathBuf], pattern: &str| -> Result<Vec<PathBuf>, String> {
        let mut paths = Vec::new();
        for folder in folders {
            let pattern = Path::new(&glob::Pattern::escape(&folder.to_string_lossy())).join(pattern);
            let matches =
                glob::glob(&pattern.to_string_lossy()).map_err(|error| format!("{entry}: no pattern: {error}"))?;
            let mut unread = |error: glob::GlobError| missing.push(format!("{entry}: cannot look there: {error}"));
            paths.extend(matches.filter_map(|found| found.map_err(&mut unread).ok()));
        }
        Ok(paths)
    };
    // The library would follow links that lead back without end.
    let (mut folders, mut rest) = (vec![folder.to_owned()], entry);
    while let Some((before, after)) =
        rest.split_once("**/").filter(|(before, _)| before.is_empty() || before.ends_with('/'))
    {
        let tops = if before.is_empty() { folders } else { found(&folders, before)? };
        folders = Vec::new();
        let mut seen = BTreeSet::new();
        tops.iter().for_each(|top| add_below(top, MAX_DEPTH, &mut seen, &mut folders));
        rest = after;
    }
    let mut paths = found(&folders, rest)?;
    paths.retain(|path| !root.is_own(path));
    let nameless = folders.iter().flat_map(|folder| nameless(rest, folder));
    missing.extend(nameless.filter(|path| !root.is_own(path)).map(|path| no_text(&path)));
    if paths.is_empty() && missing.len() == n_missing {
        Err(format!("{entry}: no file matches, looked in {}", folder.display()))
    } else {
        Ok(paths)
    }
}

/// Adds `folder` and the folders below it, each once, whatever links lead to it; hidden ones too.
fn add_below(folder: &Path, depth: usize, seen: &mut BTreeSet<PathBuf>, folders: &mut Vec<PathBuf>) {
    let is_new = folder.canonicalize().is_ok_and(|path| path.is_dir() && seen.insert(path));
    if is_new && depth > 0 {
        folders.push(folder.to_owned());
        // A folder that cannot be listed is reported where its files are looked for.
        list(folder).unwrap_or_default().iter().for_each(|path| add_below(path, depth - 1, seen, folders));
    }
}

/// Files whose names are no text, in the folder where the pattern begins; patterns do not match them.
fn nameless(entry: &str, folder: &Path) -> Vec<PathBuf> {
    let parts: Vec<&str> = entry.split('/').collect();
    let n_plain = parts.iter().take_while(|part| !part.contains(['*', '?', '['])).count();
    let begin = parts[..n_plain].iter().fold(folder.to_owned(), |folder, part| folder.join(part));
    let last = parts.last().and_then(|last| glob::Pattern::new(last).ok());
    let matches = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default();
        name.to_str().is_none() && last.as_ref().is_some_and(|last| last.matches(&name.to_string_lossy()))
    };
    list(&begin).unwrap_or_default().into_iter().filter(matches).collect()
}

/// What is wrong with a path that is no text, and what to do.
pub fn no_text(path: &Path) -> String {
    format!("{}: its name is no text (UTF-8); rename it", path.display())
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

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn folders_that_lead_back_are_looked_into_once() {
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
        assert!(found("**/*.mkv").unwrap_err().contains("no file matches"));
    }
}
