//! A take of captured motion.

use orator_base::types::pose3d::Motion;
use serde_json::{Map, Value};

/// One continuous take.
#[derive(Clone, Debug)]
pub struct CapturedMotion {
    /// At the source's rate; a joint that the source does not have is NaN.
    pub motion: Motion,
    /// Words that are spoken, where the motion's own file has them.
    pub text: Option<String>,
    /// Changes made to the joints, for the sample's metadata.
    pub facts: Map<String, Value>,
}
