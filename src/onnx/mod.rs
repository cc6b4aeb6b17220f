//! The only room that knows ONNX Runtime: finding its library, sessions, the manifest that describes the models, checks
//! of hashes, names and shapes. What the numbers of an output mean is written in the manifest and read in `pose2d`.

mod check;
mod entry;
mod manifest;
mod model;
mod runtime;

pub use entry::*;
pub use manifest::{MANIFEST_FILE, Manifest};
pub use model::{Model, OpenError, Outputs, sha256_of};
pub use runtime::{LIBRARY, Runtime, find_library};
