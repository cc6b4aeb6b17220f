//! Words of a transcript.

use serde::Serialize;

/// Word with its time, seconds after the take's beginning.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Word {
    pub start_secs: f64,
    pub end_secs: f64,
    pub word: String,
}
