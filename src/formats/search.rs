//! Finds files below a folder. A folder that is reachable through several links is visited once.

use anyhow::{Context, Result, ensure};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Maximum nesting depth of folders.
const MAX_DEPTH: usize = 64;

/// All files below `folder` that have one of the `endings` (without the dot), sorted by name within each folder.
pub fn below(folder: &Path, endings: &[&str]) -> Result<Vec<PathBuf>> {
    let mut files = files(folder, &mut |_| true)?;
    files.retain(|path| path.extension().and_then(|e| e.to_str()).is_some_and(|e| endings.contains(&e)));
    Ok(files)
}

/// All files below `folder`, sorted by name within each folder; hidden names and folders rejected by `enter` are
/// skipped.
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
