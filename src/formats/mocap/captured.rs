//! Captured motion in the joint order and axes of `types::skeleton`, but at the frame rate and with the bone lengths
//! of its source; and the reader for each kind of file.

use super::bvh::{self, GivenScale};
use super::facing::LengthUnit;
use super::motion_file::DEFAULT_FPS;
use super::ted;
use crate::{authors_txt, joints_description};
use anyhow::{Context, Result, bail};
use orator_base::motion::units;
use orator_base::types::pose3d::Motion;
use serde_json::{Map, Value};
use std::path::Path;

/// A continuous take of captured motion.
#[derive(Clone, Debug)]
pub struct CapturedMotion {
    /// Motion at the source's frame rate; joints that the source lacks are NaN.
    pub motion: Motion,
    /// Spoken text, if the motion file contains it.
    pub text: Option<String>,
    /// Changes made to the joints, recorded in the sample's metadata.
    pub facts: Map<String, Value>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MotionKind {
    /// Text clips of Rebol et al. 2021: 147 numbers per line.
    Authors,
    /// TED Expressive: `.npz` with `human_joints`.
    Ted,
    Bvh,
    /// SMPL-X or SMPL-H: `.npz` with rotations.
    Smplx,
    /// WebDataset tar shards written by this program, or a dataset folder.
    Shards,
}

impl MotionKind {
    /// Name on the command line and in facts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Authors => "authors",
            Self::Ted => "ted",
            Self::Bvh => "bvh",
            Self::Smplx => "smplx",
            Self::Shards => "shards",
        }
    }
}

/// Reads a motion file of the given kind; the unit of a BVH is detected.
pub fn read(kind: MotionKind, path: &Path) -> Result<CapturedMotion> {
    read_in(kind, path, None)
}

/// Reads a motion file of the given kind. `units` is the unit of length of a BVH; without it, the unit is detected.
///
/// # Errors
///
/// The file is unreadable, is not of that kind, or holds samples; its frame rate, unit or coordinates are implausible.
pub fn read_in(kind: MotionKind, path: &Path, units: Option<LengthUnit>) -> Result<CapturedMotion> {
    let captured = match kind {
        MotionKind::Authors => {
            let motion = authors_txt::read(path, DEFAULT_FPS)?;
            let rate = joints_description::rate(path, motion.n_frames())?;
            let motion = Motion { fps: rate.unwrap_or(DEFAULT_FPS), ..motion };
            CapturedMotion { motion, text: None, facts: Map::new() }
        }
        MotionKind::Ted => ted::read(path)?,
        MotionKind::Bvh | MotionKind::Smplx => bvh::read(path, GivenScale { units, fps: None })?,
        MotionKind::Shards => bail!("{} contains dataset samples, expected captured motion", path.display()),
    };
    captured.motion.fps.checked().with_context(|| path.display().to_string())?;
    units::check(&captured.motion).with_context(|| path.display().to_string())?;
    let motion = captured.motion.in_range().with_context(|| path.display().to_string())?;
    Ok(CapturedMotion { motion, ..captured })
}
