//! Reads any file that holds a motion: `.npy` [T, 49, 3] or [T, 147] of float32 or float64, `.npz` (`pose3d`), the
//! authors' `.txt`, `.bvh`. Of .npy and .txt the description beside them names the rate (`formats::joints_description`);
//! without one they take the rate that the caller assumes.

use super::bvh;
use crate::npz::{AxisLength, Npz};
use crate::{authors_txt, joints_description, npy};
use anyhow::{Context, Result, bail, ensure};
use ndarray::{Ix2, Ix3};
use orator_base::input;
use orator_base::motion::units;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use std::path::Path;

/// Endings of files that may hold motion.
pub const ENDINGS: [&str; 4] = ["npy", "npz", "txt", "bvh"];
/// The authors' rate, for files that do not say theirs.
pub const USUAL_FPS: FrameRate = FrameRate::new(15, 1);

/// A motion, and what had to be assumed to read it.
#[derive(Clone, Debug)]
pub struct MotionFile {
    pub motion: Motion,
    /// Whether the file, or what describes it, says its rate.
    pub says_rate: bool,
    /// Assumptions as sentences for people.
    pub notes: Vec<String>,
}

/// Whether the name of a file ends like that of a motion.
pub fn has_ending(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// Reads the motion of `path`; `fps` is the rate of a file that does not say its own (without: 15). Errors: not there,
/// empty, of another kind, another number of joints, without a frame, or without any joint that is seen: the message
/// names the file, what is in it and what was expected.
pub fn read(path: &Path, fps: Option<FrameRate>) -> Result<MotionFile> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let meta = input::open(path).and_then(|file| file.metadata());
    let size = meta.with_context(|| format!("{} cannot be read", path.display()))?.len();
    ensure!(size > 0, "{} is empty (0 bytes): expected a motion", path.display());
    let (mut notes, mut says_rate, assumed) = (Vec::new(), true, fps.unwrap_or(USUAL_FPS));
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let motion = match ending.as_str() {
        "npz" => {
            let (motion, is_said) = of_npz(path, assumed)?;
            says_rate = is_said;
            motion
        }
        "npy" | "txt" => {
            let read = if ending == "npy" { npy::read } else { authors_txt::read };
            let motion = read(path, assumed)?;
            let said = joints_description::rate(path, motion.n_frames())?;
            says_rate = said.is_some();
            Motion { fps: said.unwrap_or(assumed), ..motion }
        }
        "bvh" => {
            let captured = bvh::read_as_it_stands(path)?;
            notes.extend(bvh::unit_note(&captured.facts).map(|note| format!("{name}: {note}")));
            let turned = captured.facts.get("turned_degrees").and_then(serde_json::Value::as_f64).unwrap_or(0.0);
            if turned.abs() > 0.0 {
                notes.push(format!("{name} does not face +z: turned by {turned:.0} degrees to face the camera"));
            }
            captured.motion
        }
        _ => bail!("{} is no motion file: expected .npy, .npz, .txt (the authors' layout) or .bvh", path.display()),
    };
    // the authors' clips are 15 frames a second, which needs no remark
    if !says_rate && fps.is_none() && ending != "txt" {
        notes.push(format!("{name} does not say its rate: taken for {USUAL_FPS}; --fps says otherwise"));
    }
    ensure!(motion.n_frames() > 0, "{} has no frame", path.display());
    ensure!(
        motion.mask.iter().any(|seen| *seen),
        "{}: all joints of all {} frames are missing (NaN, or false in the mask)",
        path.display(),
        motion.n_frames()
    );
    motion.fps.checked().with_context(|| path.display().to_string())?;
    let motion = motion.in_range().with_context(|| path.display().to_string())?;
    if ending != "bvh" && units::is_upside_down(&motion) {
        notes.push(format!(
            "{name}: elbows and wrists lie above the neck throughout, as where y points up; expected x image right, y down, \
             z away"
        ));
    }
    Ok(MotionFile { motion, says_rate, notes })
}

/// Reads the motion of `path`, which its user says to be at `fps`; without, a file that does not say its rate is at 15.
/// Errors: as [`read`], and a file that says another rate than `fps`.
pub fn read_at(path: &Path, fps: Option<FrameRate>) -> Result<MotionFile> {
    let read = read(path, Some(fps.unwrap_or(USUAL_FPS)))?;
    if let Some(fps) = fps.filter(|fps| read.says_rate && *fps != read.motion.fps) {
        let own = read.motion.fps;
        bail!("{} says {own}, and {fps} is given (--in-fps): leave that away, or correct the file", path.display());
    }
    Ok(read)
}

/// `pose3d` [T, 49, 3], with `mask` [T, 49] and `fps` where they are; and whether it says its rate.
fn of_npz(path: &Path, assumed: FrameRate) -> Result<(Motion, bool)> {
    let mut npz = Npz::open(path)?;
    let shape: [AxisLength; 3] = [None, Some(N_JOINTS), Some(3)];
    let joints = npz.floats("pose3d", &shape)?.into_dimensionality::<Ix3>()?;
    let says_rate = npz.has("fps");
    let fps = if says_rate { npz.frame_rate("fps")? } else { assumed };
    let mut motion = Motion::from_joints(fps, joints);
    if npz.has("mask") {
        let seen = npz.bools("mask", &[Some(motion.n_frames()), Some(N_JOINTS)])?.into_dimensionality::<Ix2>()?;
        motion.mask.zip_mut_with(&seen, |there, seen| *there &= seen);
    }
    Ok((motion, says_rate))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints_npz;
    use ndarray::{Array, Array2, Array3};
    use ndarray_npy::WriteNpyExt as _;
    use std::fs::File;

    #[test]
    fn every_kind_of_array_is_the_same_motion() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let joints = Array3::from_shape_fn((5, N_JOINTS, 3), |(t, j, k)| (t * 147 + j * 3 + k) as f32 / 1024.0);
        joints.write_npy(File::create(at("a.npy")).unwrap()).unwrap();
        joints.mapv(f64::from).write_npy(File::create(at("b.npy")).unwrap()).unwrap();
        let flat = joints.clone().into_shape_with_order((5, 147)).unwrap();
        flat.write_npy(File::create(at("c.npy")).unwrap()).unwrap();
        let fps = FrameRate::new(30, 1);
        let mut motion = Motion::from_joints(fps, joints.clone());
        motion.mask[[2, 5]] = false;
        joints_npz::write(&at("d.npz"), &motion).unwrap();
        for name in ["a.npy", "b.npy", "c.npy"] {
            let found = read(&at(name), Some(fps)).unwrap();
            assert!(found.motion.joints == joints && found.motion.fps == fps && found.notes.is_empty(), "{name}");
            let found = read(&at(name), None).unwrap();
            assert!(found.motion.fps == USUAL_FPS && found.notes[0].contains("--fps"), "{name}");
        }
        assert_eq!(read(&at("d.npz"), Some(FrameRate::new(7, 1))).unwrap().motion, motion);
    }

    #[test]
    fn what_is_no_motion_is_refused_in_words() {
        let dir = tempfile::tempdir().unwrap();
        let said = |name: &str, write: &dyn Fn(&Path)| {
            let path = dir.path().join(name);
            write(&path);
            format!("{:#}", read(&path, None).unwrap_err())
        };
        let npy = |shape: (usize, usize, usize), value: f32| {
            move |path: &Path| Array3::from_elem(shape, value).write_npy(File::create(path).unwrap()).unwrap()
        };
        let (whole, flat) = (Array2::<i32>::zeros((4, 147)), Array::<f32, _>::zeros(147));
        let cases = [
            (said("gone.npy", &|_| ()), "cannot be read"),
            (said("empty.npy", &|path| std::fs::write(path, "").unwrap()), "is empty"),
            (said("joints.npy", &npy((4, 43, 3), 0.0)), "[4, 43, 3]"),
            (said("none.npy", &npy((0, 49, 3), 0.0)), "no frame"),
            (said("nan.npy", &npy((4, 49, 3), f32::NAN)), "all joints of all 4 frames are missing"),
            (said("whole.npy", &|path| whole.write_npy(File::create(path).unwrap()).unwrap()), "float"),
            (said("a.mp4", &|path| std::fs::write(path, "x").unwrap()), "expected .npy"),
            (said("a.txt", &|path| std::fs::write(path, "1 2 3\n").unwrap()), "147"),
            (said("a.bvh", &|path| std::fs::write(path, "x").unwrap()), "a.bvh"),
            (said("flat.npy", &|path| flat.write_npy(File::create(path).unwrap()).unwrap()), "[147]"),
        ];
        for (text, says) in cases {
            assert!(text.contains(says), "{says}: {text}");
        }
    }
}
