//! Reads keypoints in the format detected from the content of the file, or from a folder with one JSON file per
//! frame, as written by OpenPose (`NAME_000000000012_keypoints.json`).

use super::counted::{self, CountedPerson};
use super::document::FramePersons;
use super::found::{CoordinateUnit, FoundKeypoints};
use super::frames::number_of;
use super::range::check_pixels;
use super::{arrays, document, plausible};
use crate::joints_description::is_description;
use anyhow::{Context, Result, bail, ensure};
use orator_base::input;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Fraction of negative coordinates from which on coordinates are not fractions of the image.
const MAX_NEGATIVE: f64 = 0.2;

/// Maximum size of the file of one frame, bytes.
const MAX_FRAME_BYTES: u64 = 16 << 20;

/// Reads keypoints in any known format. Errors name the file, the position and what was expected.
pub fn read(path: &Path) -> Result<FoundKeypoints> {
    let found = if path.is_dir() { read_folder(path)? } else { read_file(path)? };
    let shown = path.display();
    ensure!(!found.frames.is_empty(), "{shown} has no frames");
    ensure!(
        found.frames.iter().flatten().any(|person| person.area().is_some()),
        "{shown}: no person is visible in any frame"
    );
    ensure!(
        found.unit != CoordinateUnit::Fraction || found.negative_fraction() < MAX_NEGATIVE,
        "{shown}: coordinates are between -1 and 1: expected pixels (OpenPose: --keypoint_scale 0) or fractions \
         of the image size from 0 to 1 (--keypoint_scale 3)"
    );
    if found.unit == CoordinateUnit::Pixels {
        check_pixels(found.coordinates()).with_context(|| shown.to_string())?;
    }
    if !found.layout.is_empty() {
        plausible::check(&found).with_context(|| shown.to_string())?;
    }
    Ok(found)
}

fn read_file(path: &Path) -> Result<FoundKeypoints> {
    let bytes = input::read(path, input::MAX_DATA).with_context(|| format!("cannot read {}", path.display()))?;
    match bytes.get(..4) {
        _ if path.extension().is_some_and(|end| end == "npz") => arrays::read_npz(path),
        Some(b"PK\x03\x04") => arrays::read_npz(path),
        Some(b"\x93NUM") => arrays::read_npy(path, &bytes),
        Some(b"\x89HDF") => bail!(
            "{} is HDF5 (not supported); save its arrays with numpy.savez (PATS: `pose/data` and `pose/confidence`)",
            path.display()
        ),
        _ => document::parse(&bytes).with_context(|| format!("{} has no readable keypoints", path.display())),
    }
}

/// Reads the frames of a folder, numbered by the digits of their file names.
fn read_folder(folder: &Path) -> Result<FoundKeypoints> {
    let listed = std::fs::read_dir(folder).with_context(|| format!("cannot list the folder {}", folder.display()))?;
    let paths = listed.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let is_frame =
        |path: &PathBuf| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("json")) && !is_description(path);
    let mut files: Vec<PathBuf> = paths.filter(is_frame).collect();
    files.sort();
    ensure!(!files.is_empty(), "{} contains no .json files of frames", folder.display());
    let mut program = "";
    let mut frames: BTreeMap<u64, (&PathBuf, Vec<CountedPerson>)> = BTreeMap::new();
    for file in &files {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let number = number_of(&name)
            .with_context(|| format!("{}: expected the frame number in the file name", file.display()))?;
        let bytes = input::read(file, MAX_FRAME_BYTES).with_context(|| format!("cannot read {}", file.display()))?;
        let read = document::read_persons(&bytes).with_context(|| file.display().to_string())?;
        program = read.program;
        let entries = match read.persons {
            FramePersons::Picture(entries) => entries,
            FramePersons::Frames(frames) => bail!(
                "{} has {} frames: expected one frame per file in a folder; give the path of the file instead",
                file.display(),
                frames.len()
            ),
        };
        // Entries are converted at once: their lists of numbers take more memory than persons.
        let persons = document::persons(number, &entries).with_context(|| folder.display().to_string())?;
        if let Some((other, _)) = frames.insert(number, (file, persons)) {
            bail!(
                "{} and {} are both frame {number}; use a separate folder for each video",
                other.display(),
                file.display()
            );
        }
    }
    let frames = frames.into_iter().map(|(number, (_, persons))| (number, persons)).collect();
    counted::of_persons(program, frames).with_context(|| folder.display().to_string())
}
