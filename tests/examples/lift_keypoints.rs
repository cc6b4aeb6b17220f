//! Lifts 2D keypoints to 3D and writes the motion as an animation (`.bvh`, `.glb`, `.json`, `.npy` or `.mp4`).
//!
//! ```text
//! cargo run --release --example lift_keypoints -- work/pose2d/host/VIDEO/keypoints.npz lifted.bvh
//! ```

#![allow(clippy::print_stdout)] // a program

use anyhow::{Result, bail};
use orator::{AnimationOptions, ExportContent, ExportFormat, LiftConfig, Lifter, Silent, perform, read_keypoints};
use std::path::{Path, PathBuf};

fn main() -> Result<()> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [keypoints, out] = paths.as_slice() else { bail!("expected KEYPOINTS.npz OUT.bvh") };
    println!("{}", lift(keypoints, out)?);
    Ok(())
}

/// Lifts with the built-in weights; gives a line on what was lifted.
pub(crate) fn lift(keypoints: &Path, out: &Path) -> Result<String> {
    let format = ExportFormat::from_path(out)?;
    let keypoints = read_keypoints(keypoints)?;
    let lifter = Lifter::new(&LiftConfig::default())?;
    let lifted = lifter.lift_all(&keypoints)?;

    // Joints are metres about the neck; a joint that is filled over a gap is masked, a missing one is NaN.
    let motion = &lifted.motion;
    let n_visible = motion.mask.iter().filter(|seen| **seen).count();
    let share = 100.0 * n_visible as f64 / motion.mask.len().max(1) as f64;

    // A performance is the motion on a rig: smoothed, and within what a body can do.
    let performance = perform(motion, None, &AnimationOptions::default());
    format.write(out, &performance, &ExportContent::default(), &Silent)?;
    Ok(format!("{} frames at {}, {share:.0} % of the joints seen: {}", motion.n_frames(), motion.fps, out.display()))
}
