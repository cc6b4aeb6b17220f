//! A take of captured motion.

use crate::types::pose3d::Motion;
use serde_json::{Map, Value};

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
