//! Captured motion as its source holds it, in house order and axes but at the source's own rate and with its own
//! bones; and which reader a file needs.

use super::{bvh, ted};
use crate::dataset::import::find::Kind;
use crate::formats::authors_txt;
use crate::types::pose3d::Motion;
use crate::types::time::FrameRate;
use anyhow::{Result, bail};
use serde_json::{Map, Value};
use std::path::Path;

/// The authors' clips do not name their rate.
const AUTHORS_FPS: FrameRate = FrameRate::new(15, 1);

/// One continuous take.
#[derive(Clone, Debug)]
pub struct Captured {
    /// At the source's rate; a joint that the source does not have is NaN.
    pub motion: Motion,
    /// What is said, where the motion's own file says it.
    pub text: Option<String>,
    /// What was done to the joints, for the sample's facts.
    pub facts: Map<String, Value>,
}

impl Captured {
    /// Reads the motion file of a take of that kind.
    pub fn read(kind: Kind, path: &Path) -> Result<Self> {
        match kind {
            Kind::Authors => {
                let motion = authors_txt::read(path, AUTHORS_FPS)?;
                Ok(Self { motion, text: None, facts: Map::new() })
            }
            Kind::Ted => ted::read(path),
            Kind::Bvh => bvh::read(path),
            Kind::Shards => bail!("{} holds samples, no captured motion", path.display()),
        }
    }
}
