//! Reads motion files of any kind: `.npy` [T, 49, 3] or [T, 147] of float32 or float64, `.npz` (`pose3d`, or SMPL-X),
//! the authors' `.txt`, and `.bvh`. The frame rate of .npy and .txt files comes from their description file
//! (`formats::joints_description`), or else from the caller.

use super::bvh::{self, GivenScale};
use super::facing::LengthUnit;
use super::smplx::motion::{is_smplx, states_rate};
use crate::npz::{AxisLength, Npz};
use crate::{authors_txt, joints_description, npy};
use anyhow::{Context, Result, bail, ensure};
use ndarray::{Ix2, Ix3};
use orator_base::input;
use orator_base::motion::units;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use std::ffi::OsStr;
use std::path::Path;

pub const ENDINGS: [&str; 4] = ["npy", "npz", "txt", "bvh"];
/// Frame rate of Rebol et al. 2021, for files that do not state theirs.
pub const DEFAULT_FPS: FrameRate = FrameRate::new(15, 1);

/// A motion, and the assumptions made to read it.
#[derive(Clone, Debug)]
pub struct MotionFile {
    pub motion: Motion,
    /// Whether the file or its description states the frame rate.
    pub has_rate: bool,
    /// Assumptions, one sentence each.
    pub notes: Vec<String>,
}

pub fn has_ending(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// Whether the name ends with `.smplx.npz`, as that of SMPL-X files of this program.
pub fn is_smplx_name(path: &Path) -> bool {
    let is = |name: &Path, ending: &str| name.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    is(path, "npz") && path.file_stem().is_some_and(|stem| is(Path::new(stem), "smplx"))
}

/// File name without its extension; `.smplx.npz` counts as one extension.
pub fn stem(path: &Path) -> &OsStr {
    let stem = path.file_stem().unwrap_or_default();
    if is_smplx_name(path) { Path::new(stem).file_stem().unwrap_or_default() } else { stem }
}

/// Whether the file has a skeleton, from which captured head, trunk and legs can be read: BVH or SMPL-X.
///
/// # Errors
///
/// An unreadable `.npz`.
pub fn has_skeleton(path: &Path) -> Result<bool> {
    let is = |ending: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    if !is("npz") {
        return Ok(is("bvh"));
    }
    let npz = Npz::open(path)?;
    Ok(!npz.has("pose3d") && is_smplx(&npz))
}

/// Reads the motion of `path`; `fps` (default 15) is the frame rate of a file that does not state its own.
///
/// # Errors
///
/// The file is missing, empty or of another kind, has another number of joints, no frames or no visible joint; the
/// message names the file, what it contains and what was expected.
pub fn read(path: &Path, fps: Option<FrameRate>) -> Result<MotionFile> {
    let mut read = read_in(path, fps, None)?;
    // The authors' clips always have 15 frames per second, which needs no note.
    let is_text = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt"));
    if !read.has_rate && fps.is_none() && !is_text {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let note = format!("{name} has no frame rate: assuming {DEFAULT_FPS}; set it with --input-fps");
        read.notes.insert(0, note);
    }
    Ok(read)
}

/// [`read`] without a note on an assumed frame rate, and with the unit of length of a .bvh file.
fn read_in(path: &Path, fps: Option<FrameRate>, units: Option<LengthUnit>) -> Result<MotionFile> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let meta = input::open(path).and_then(|file| file.metadata());
    let size = meta.with_context(|| format!("cannot read {}", path.display()))?.len();
    ensure!(size > 0, "{} is empty (0 bytes): expected motion", path.display());
    let (mut notes, assumed) = (Vec::new(), fps.unwrap_or(DEFAULT_FPS));
    let has_rate;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    ensure!(
        units.is_none() || ending == "bvh",
        "{}: --units applies to .bvh files; other files are in metres",
        path.display()
    );
    let has_skeleton = has_skeleton(path)?;
    let motion = match ending.as_str() {
        "bvh" | "npz" if has_skeleton => {
            has_rate = ending == "bvh" || states_rate(&Npz::open(path)?);
            let captured = bvh::read_unrotated(path, GivenScale { units, fps })?;
            notes.extend(bvh::notes(&captured.facts).into_iter().map(|note| format!("{name}: {note}")));
            let rotated_degrees =
                captured.facts.get("turned_degrees").and_then(serde_json::Value::as_f64).unwrap_or(0.0);
            if rotated_degrees.abs() >= 0.5 {
                notes.push(format!(
                    "{name} does not face +z: rotated by {rotated_degrees:.0} degrees to face the camera"
                ));
            }
            captured.motion
        }
        "npz" => {
            let (motion, is_stated) = read_npz(path, assumed)?;
            has_rate = is_stated;
            motion
        }
        "npy" | "txt" => {
            let read = if ending == "npy" { npy::read } else { authors_txt::read };
            let motion = read(path, assumed)?;
            let stated = joints_description::rate(path, motion.n_frames())?;
            has_rate = stated.is_some();
            Motion { fps: stated.unwrap_or(assumed), ..motion }
        }
        _ => bail!("{} is not a motion file: expected .npy, .npz, .txt (the authors' layout) or .bvh", path.display()),
    };
    ensure!(motion.n_frames() > 0, "{} has no frames", path.display());
    ensure!(
        motion.mask.iter().any(|is_visible| *is_visible),
        "{}: all joints of all {} frames are missing (NaN, or false in the mask)",
        path.display(),
        motion.n_frames()
    );
    motion.fps.checked().with_context(|| path.display().to_string())?;
    let motion = motion.in_range().with_context(|| path.display().to_string())?;
    if !has_skeleton && units::is_upside_down(&motion) {
        notes.push(format!(
            "{name}: elbows and wrists are always above the neck, so y seems to point up: expected x image right, \
             y down, z away"
        ));
    }
    Ok(MotionFile { motion, has_rate, notes })
}

/// Reads the motion of `path` at the frame rate `fps` given by the user; without it, a file that does not state its
/// frame rate is read at 15. `units` is the unit of length of a .bvh file; without it, the unit is detected.
///
/// # Errors
///
/// Those of [`read`], a file that states a rate other than `fps`, and `units` for another kind of file.
pub fn read_at(path: &Path, fps: Option<FrameRate>, units: Option<LengthUnit>) -> Result<MotionFile> {
    let read = read_in(path, fps, units)?;
    if let Some(fps) = fps.filter(|fps| read.has_rate && *fps != read.motion.fps) {
        let own = read.motion.fps;
        bail!(
            "{} has a frame rate of {own}, but --input-fps is {fps}: omit --input-fps or correct the file",
            path.display()
        );
    }
    Ok(read)
}

/// Reads `pose3d` [T, 49, 3], with `mask` [T, 49] and `fps` if present; returns whether the file states its frame rate.
fn read_npz(path: &Path, assumed: FrameRate) -> Result<(Motion, bool)> {
    let mut npz = Npz::open(path)?;
    let shape: [AxisLength; 3] = [None, Some(N_JOINTS), Some(3)];
    let joints = npz.floats("pose3d", &shape)?.into_dimensionality::<Ix3>()?;
    let has_rate = npz.has("fps");
    let fps = if has_rate { npz.frame_rate("fps")? } else { assumed };
    let mut motion = Motion::from_joints(fps, joints);
    if npz.has("mask") {
        let is_visible = npz.bools("mask", &[Some(motion.n_frames()), Some(N_JOINTS)])?.into_dimensionality::<Ix2>()?;
        motion.mask.zip_mut_with(&is_visible, |is_valid, is_visible| *is_valid &= is_visible);
    }
    Ok((motion, has_rate))
}
