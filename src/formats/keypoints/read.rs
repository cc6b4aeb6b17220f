//! The kind of a file or folder of keypoints, by its content.

use super::found::{CoordinateUnit, FoundKeypoints};
use super::range::check_pixels;
use super::{arrays, document, folder};
use anyhow::{Context, Result, bail, ensure};
use std::path::Path;

/// Share of negative coordinates from which on shares of the picture are none.
const MOST_NEGATIVE: f64 = 0.2;

/// Reads keypoints of any known kind. Errors name the file, the place, what was expected.
pub fn read(path: &Path) -> Result<FoundKeypoints> {
    let found = if path.is_dir() { folder::read(path)? } else { read_file(path)? };
    let shown = path.display();
    ensure!(!found.frames.is_empty(), "{shown} has no frames");
    ensure!(
        found.frames.iter().flatten().any(|person| person.area().is_some()),
        "{shown}: nobody is seen in any frame"
    );
    ensure!(
        found.unit != CoordinateUnit::Share || found.negative_share() < MOST_NEGATIVE,
        "{shown}: its coordinates lie between -1 and 1; write them in pixels (OpenPose: --keypoint_scale 0) or as shares \
         of the picture from 0 to 1 (--keypoint_scale 3)"
    );
    if found.unit == CoordinateUnit::Pixels {
        check_pixels(found.places()).with_context(|| shown.to_string())?;
    }
    Ok(found)
}

fn read_file(path: &Path) -> Result<FoundKeypoints> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    match bytes.get(..4) {
        _ if path.extension().is_some_and(|end| end == "npz") => arrays::read_npz(path),
        Some(b"PK\x03\x04") => arrays::read_npz(path),
        Some(b"\x93NUM") => arrays::read_npy(path, &bytes),
        Some(b"\x89HDF") => bail!(
            "{} is HDF5, which is not read; save its arrays with numpy.savez, for PATS `pose/data` and `pose/confidence`",
            path.display()
        ),
        _ => document::parse(&bytes).with_context(|| format!("{}: no keypoints can be read", path.display())),
    }
}
