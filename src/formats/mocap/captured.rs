//! Captured motion as its source holds it, in house order and axes but at the source's own rate and with its own
//! bones; and which reader a file needs.

use super::motion_file::USUAL_FPS;
use super::{bvh, ted};
use crate::{authors_txt, joints_description};
use anyhow::{Context, Result, bail};
use orator_base::motion::units;
use orator_base::types::pose3d::Motion;
use serde_json::{Map, Value};
use std::path::Path;

/// One continuous take of captured motion.
#[derive(Clone, Debug)]
pub struct CapturedMotion {
    /// At the source's rate; a joint that the source does not have is NaN.
    pub motion: Motion,
    /// Words that are spoken, where the motion's own file has them.
    pub text: Option<String>,
    /// Changes made to the joints, for the sample's metadata.
    pub facts: Map<String, Value>,
}

/// Kind of a file of captured motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MotionKind {
    /// The authors' text clips: 147 numbers a line.
    Authors,
    /// TED Expressive: `.npz` with `human_joints`.
    Ted,
    Bvh,
    /// WebDataset tar shards of ours, or a dataset's folder.
    Shards,
}

impl MotionKind {
    /// Its name on the command line and in facts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Authors => "authors",
            Self::Ted => "ted",
            Self::Bvh => "bvh",
            Self::Shards => "shards",
        }
    }
}

/// Reads the motion file of a take of that kind.
pub fn read(kind: MotionKind, path: &Path) -> Result<CapturedMotion> {
    let captured = match kind {
        MotionKind::Authors => {
            let motion = authors_txt::read(path, USUAL_FPS)?;
            let said = joints_description::rate(path, motion.n_frames())?;
            let motion = Motion { fps: said.unwrap_or(USUAL_FPS), ..motion };
            CapturedMotion { motion, text: None, facts: Map::new() }
        }
        MotionKind::Ted => ted::read(path)?,
        MotionKind::Bvh => bvh::read(path)?,
        MotionKind::Shards => bail!("{} holds samples, no captured motion", path.display()),
    };
    captured.motion.fps.checked().with_context(|| path.display().to_string())?;
    units::check(&captured.motion).with_context(|| path.display().to_string())?;
    let motion = captured.motion.in_range().with_context(|| path.display().to_string())?;
    Ok(CapturedMotion { motion, ..captured })
}
