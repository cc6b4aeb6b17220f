//! Inputs and outputs of a model.

use serde::{Deserialize, Serialize};

/// A named tensor; -1 stands for any size.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Port {
    pub name: String,
    pub shape: Vec<i64>,
}
