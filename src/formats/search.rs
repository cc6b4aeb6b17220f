//! Finds files below a folder, and files by name. A folder that is reachable through several links is visited once.

use anyhow::{Context, Result, ensure};
use orator_base::text::composed;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

const MAX_DEPTH: usize = 64;

/// Files found by name. Accented letters may be composed or decomposed, and endings have any case, since cameras,
/// recorders and some systems write such names. Each folder is listed once.
#[derive(Default)]
pub struct NamedFiles(BTreeMap<PathBuf, BTreeMap<String, PathBuf>>);

impl NamedFiles {
    /// Existing files `STEM.ENDING` in `folder`, by `stems`, then `endings` (without dot). An exact name is preferred.
    pub fn find(&mut self, folder: &Path, stems: &[&str], endings: &[&str]) -> Vec<PathBuf> {
        let listed = self.0.entry(folder.to_owned()).or_insert_with(|| names_in(folder));
        let named = |(stem, ending): (&str, &str)| {
            let exact = folder.join(format!("{stem}.{ending}"));
            if exact.is_file() { Some(exact) } else { listed.get(&name_key(stem, ending)).cloned() }
        };
        let names = stems.iter().flat_map(|stem| endings.iter().map(move |ending| (*stem, *ending)));
        names.filter_map(named).collect()
    }
}

/// Files of a folder by `name_key`; none if it cannot be listed.
fn names_in(folder: &Path) -> BTreeMap<String, PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    paths.sort();
    let mut names = BTreeMap::new();
    for path in paths {
        let parts = [path.file_stem(), path.extension()].map(|part| part.and_then(OsStr::to_str));
        if let [Some(stem), Some(ending)] = parts {
            names.entry(name_key(stem, ending)).or_insert(path);
        }
    }
    names
}

fn name_key(stem: &str, ending: &str) -> String {
    format!("{}.{}", composed(stem), ending.to_ascii_lowercase())
}

/// The existing file or folder that `path` names in any form of its accents; `path` itself if there is none.
pub fn existing(path: &Path) -> PathBuf {
    let (Some(folder), Some(name), false) = (path.parent(), path.file_name(), path.exists()) else {
        return path.to_owned();
    };
    let key = |name: &OsStr| composed(&name.to_string_lossy());
    let folder = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { existing(folder) };
    let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten();
    let is_same = |one: &PathBuf| one.file_name().is_some_and(|one| key(one) == key(name));
    let found = entries.map(|entry| entry.path()).filter(is_same).min();
    found.unwrap_or_else(|| path.to_owned())
}

/// Files below `folder` with one of the `endings` (lower case, without dot) in any case, by name within each folder.
pub fn below(folder: &Path, endings: &[&str]) -> Result<Vec<PathBuf>> {
    let mut files = files(folder, &mut |_| true)?;
    let is_one = |ending: &str| endings.contains(&ending.to_ascii_lowercase().as_str());
    files.retain(|path| path.extension().and_then(|ending| ending.to_str()).is_some_and(is_one));
    Ok(files)
}

/// All files below `folder`, by name within each folder; hidden names and folders rejected by `enter` are skipped.
///
/// # Errors
///
/// A folder cannot be listed, or is nested more than 64 folders deep.
pub fn files(folder: &Path, enter: &mut dyn FnMut(&Path) -> bool) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    walk(folder, MAX_DEPTH, &mut BTreeSet::new(), enter, &mut files)?;
    Ok(files)
}

fn walk(
    folder: &Path,
    depth: usize,
    visited: &mut BTreeSet<PathBuf>,
    enter: &mut dyn FnMut(&Path) -> bool,
    files: &mut Vec<PathBuf>,
) -> Result<()> {
    let listing = || format!("cannot list {}", folder.display());
    if !visited.insert(folder.canonicalize().with_context(listing)?) || !enter(folder) {
        return Ok(());
    }
    ensure!(
        depth > 0,
        "{} is nested more than {MAX_DEPTH} folders deep; start at a folder further down",
        folder.display()
    );
    let entries = std::fs::read_dir(folder).with_context(listing)?;
    let mut entries = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>().with_context(listing)?;
    entries.sort();
    for path in entries {
        if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')) {
            continue;
        }
        match path.metadata() {
            Ok(meta) if meta.is_dir() => walk(&path, depth - 1, visited, enter, files)?,
            // Reading a pipe or a device may never end.
            Ok(meta) if !meta.is_file() => {}
            _ => files.push(path),
        }
    }
    Ok(())
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn names_match_in_any_case_of_the_ending_and_any_form_of_accents() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for name in ["Cafe\u{301} 1.WAV", "b.wav", "b.WAV", "b.Flac", "B.mp3", "c.TextGrid"] {
            std::fs::write(at(name), "").unwrap();
        }
        let mut files = NamedFiles::default();
        let mut find = |stems: &[&str], endings: &[&str]| files.find(dir.path(), stems, endings);
        assert_eq!(find(&["Caf\u{e9} 1"], &["mp3", "wav"]), [at("Cafe\u{301} 1.WAV")]);
        assert_eq!(find(&["x", "b"], &["mp3", "flac", "wav"]), [at("b.Flac"), at("b.wav")]);
        assert_eq!(find(&["c"], &["textgrid"]), [at("c.TextGrid")]);
        assert!(NamedFiles::default().find(&at("none"), &["b"], &["wav"]).is_empty());
        std::fs::create_dir(at("Vortra\u{308}ge")).unwrap();
        std::fs::write(at("Vortra\u{308}ge/u\u{308}.mp4"), "").unwrap();
        assert_eq!(existing(&at("Vortr\u{e4}ge/\u{fc}.mp4")), at("Vortra\u{308}ge/u\u{308}.mp4"));
        assert_eq!([at("b.wav"), at("no/x")].map(|path| existing(&path)), [at("b.wav"), at("no/x")]);
        assert_eq!(below(dir.path(), &["wav"]).unwrap().len(), 3);
    }

    #[test]
    fn link_cycles_are_visited_once() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("a/b")).unwrap();
        ["a/b/c.bvh", "d.bvh", ".hidden.bvh", "e.txt"].iter().for_each(|name| std::fs::write(at(name), "").unwrap());
        symlink(".", at("one")).unwrap();
        symlink(".", at("two")).unwrap();
        symlink("../..", at("a/b/up")).unwrap();
        symlink("d.bvh", at("z.bvh")).unwrap();
        assert_eq!(below(dir.path(), &["bvh"]).unwrap(), [at("a/b/c.bvh"), at("d.bvh"), at("z.bvh")]);
        let without = files(dir.path(), &mut |folder| !folder.ends_with("b")).unwrap();
        assert_eq!(without, [at("d.bvh"), at("e.txt"), at("z.bvh")]);
        std::fs::create_dir_all(at(&"f/".repeat(MAX_DEPTH + 1))).unwrap();
        assert!(format!("{:#}", below(dir.path(), &[]).unwrap_err()).contains("64 folders deep"));
        assert!(below(&at("none"), &[]).is_err());
    }
}
