//! Description file for joint arrays that do not store their frame rate: `motion.npy.json` next to `motion.npy`,
//! `motion.txt.json` next to `motion.txt`. One object: `format` "orator joints", `version` 1, `fps` [numerator,
//! denominator] (a number is also accepted), `n_frames`, `shape`, `units`, `axes`.

use anyhow::{Context as _, Result, bail, ensure};
use orator_base::input;
use orator_base::stage::workdir;
use orator_base::types::time::FrameRate;
use serde::Deserialize;
use serde_json::json;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

#[derive(Debug, Deserialize)]
struct JointsDescription {
    fps: DescribedRate,
    n_frames: Option<usize>,
}

/// Frames per second, as a fraction or as a number.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum DescribedRate {
    Fraction([u32; 2]),
    Number(f64),
}

/// Path of the description file for the joints at `path`.
pub fn path_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

pub fn is_description(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    [".npy.json", ".txt.json"].iter().any(|ending| name.ends_with(ending))
}

/// Frame rate of the joints at `path` according to their description file; `None` if there is none.
///
/// # Errors
///
/// The description is unreadable, has no plausible frame rate, or is for a number of frames other than `n_frames`.
pub fn rate(path: &Path, n_frames: usize) -> Result<Option<FrameRate>> {
    let (description_path, file) = (path_of(path), path.display());
    let text = match input::read(&description_path, input::MAX_TEXT) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error).with_context(|| format!("cannot read {}", description_path.display())),
    };
    let description_path = description_path.display();
    let remedy = || format!("delete it, or replace its content with {{\"fps\": [30, 1]}} (the rate of {file})");
    let description: JointsDescription = serde_json::from_slice(&text)
        .with_context(|| format!("{description_path} has no frame rate for {file}: {}", remedy()))?;
    let rate = match description.fps {
        DescribedRate::Fraction([num, den]) if num > 0 && den > 0 => Some(FrameRate::new(num, den)),
        DescribedRate::Number(per_sec) => FrameRate::nearest(per_sec),
        DescribedRate::Fraction(_) => None,
    };
    let Some(rate) = rate.filter(|rate| rate.is_plausible()) else {
        bail!("{description_path}: invalid `fps`: expected 1 to 1000 frames per second; {}", remedy())
    };
    if let Some(described) = description.n_frames {
        ensure!(
            described == n_frames,
            "{description_path} describes {described} frames, but {file} has {n_frames}; {}",
            remedy()
        );
    }
    Ok(Some(rate))
}

/// Writes the joints to `path` with `write`, then their description. An old description is removed first, so that it
/// can never be mistaken for that of the new joints.
pub fn with(path: &Path, fps: FrameRate, shape: &[usize], write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let description_path = path_of(path);
    match std::fs::remove_file(&description_path) {
        Err(error) if !matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Err(error).with_context(|| format!("cannot replace {}", description_path.display()));
        }
        _ => workdir::replace(path, write)?,
    }
    let description = json!({
        "format": "orator joints",
        "version": 1,
        "fps": [fps.num, fps.den],
        "n_frames": shape.first(),
        "shape": shape,
        "units": "metres",
        "axes": "x image right, y down, z away from the camera, the neck at the origin",
    });
    workdir::write_file(&description_path, format!("{description}\n").as_bytes())
}
