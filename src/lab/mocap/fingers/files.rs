//! Finds captured or labelled fingers in files and folders, each kind told apart by what it holds: `.bvh` by joint
//! names (`bvh`); `.npz` with SMPL-X `poses` [T, 165] on an assumed rest hand, or with `human_joints` [T, 43, 3] of TED
//! speakers, without tips (`npz`); `.txt` of 48 numbers a line, ICVL labels from the middles of bones, or of 42, NYU
//! labels without knuckles, whose errors are after alignment only (`labels`). Sizes: the middle proximal phalanx 48 mm;
//! TED wrist to middle knuckle 93.2 mm; NYU the middle finger's last two bones 51.3 mm.

use super::labels;
use anyhow::{Result, bail, ensure};
use orator_formats::mocap::fingers::take::FingerTake;
use orator_formats::mocap::fingers::{bvh, npz};
use orator_formats::search;
use std::path::{Path, PathBuf};

/// The fingers of one file or folder.
pub struct FingerSet {
    /// The file's or folder's own name.
    pub name: String,
    pub takes: Vec<FingerTake>,
}

/// One set a path. In a folder, files without fingers are passed over. Errors: a named file without fingers, a folder
/// without any file that has some (says why of the first).
pub fn read_all(paths: &[PathBuf]) -> Result<Vec<FingerSet>> {
    paths.iter().map(|path| read_set(path)).collect()
}

fn read_set(path: &Path) -> Result<FingerSet> {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    if !path.is_dir() {
        return Ok(FingerSet { name, takes: read(path)? });
    }
    let files = search::below(path, &["bvh", "npz", "txt"])?;
    ensure!(!files.is_empty(), "no .bvh, .npz or .txt file in {}", path.display());
    let (mut takes, mut first_error) = (Vec::new(), None);
    for file in files {
        match read(&file) {
            Ok(found) => takes.extend(found),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    match first_error {
        Some(error) if takes.is_empty() => Err(error.context(format!("no fingers in {}", path.display()))),
        _ => Ok(FingerSet { name, takes }),
    }
}

/// The hands of one file.
pub fn read(path: &Path) -> Result<Vec<FingerTake>> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("bvh") => bvh::read(path),
        Some("npz") => npz::read(path),
        Some("txt") => Ok(vec![labels::read(path)?]),
        _ => bail!("{}: fingers are read from .bvh, .npz and .txt files", path.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_fingers_says_why() {
        let dir = tempfile::tempdir().unwrap();
        let says = |paths: &[PathBuf]| format!("{:#}", read_all(paths).err().unwrap());
        assert!(says(&[dir.path().to_owned()]).contains("no .bvh"));
        std::fs::write(dir.path().join("a.txt"), "1 2 3").unwrap();
        assert!(says(&[dir.path().to_owned()]).contains("3 numbers a line"));
        assert!(says(&[dir.path().join("a.fbx")]).contains("a.fbx"));
        assert!(says(&[dir.path().join("none.txt")]).contains("none.txt"));
    }
}
