//! A folder with a JSON file for each frame, as OpenPose writes it (`NAME_000000000012_keypoints.json`).

use super::document::{self, FramePeople};
use super::entry::JsonEntry;
use super::found::FoundKeypoints;
use crate::joints::description::is_one;
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Reads the frames of a folder, numbered by the digits of their file names.
pub fn read(folder: &Path) -> Result<FoundKeypoints> {
    let listed = std::fs::read_dir(folder).with_context(|| format!("cannot list the folder {}", folder.display()))?;
    let paths = listed.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let is_frame =
        |path: &PathBuf| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("json")) && !is_one(path);
    let mut files: Vec<PathBuf> = paths.filter(is_frame).collect();
    files.sort();
    ensure!(!files.is_empty(), "{} holds no .json file of a frame", folder.display());
    let mut program = "";
    let mut frames: BTreeMap<u64, (&PathBuf, Vec<JsonEntry>)> = BTreeMap::new();
    for file in &files {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let number = super::frames::number_of(&name)
            .with_context(|| format!("{}: no digits in its name say which frame it is", file.display()))?;
        let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        let read = document::people(&bytes).with_context(|| file.display().to_string())?;
        program = read.program();
        let people = match read.people {
            FramePeople::Picture(people) => people,
            FramePeople::Frames(frames) => bail!(
                "{} holds {} frames, expected one a file in a folder; name the file itself",
                file.display(),
                frames.len()
            ),
        };
        if let Some((other, _)) = frames.insert(number, (file, people)) {
            bail!(
                "{} and {} are both frame {number}; each video needs a folder of its own",
                other.display(),
                file.display()
            );
        }
    }
    let frames = frames.into_iter().map(|(number, (_, people))| (number, people)).collect();
    document::of_frames(program, frames).with_context(|| folder.display().to_string())
}
