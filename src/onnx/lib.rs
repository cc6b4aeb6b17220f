//! The only crate that uses ONNX Runtime: finding its library, sessions, the manifest that describes the models,
//! checks of hashes, names and shapes, the models folder, and conversion from other formats. The manifest states the
//! meaning of each output; `pose2d` decodes them.

mod batch;
pub mod check;
pub mod convert;
pub mod entry;
mod fetch;
pub mod manifest;
pub mod model;
mod package;
pub mod runtime;
pub mod source;
pub mod speech;
pub mod store;

pub use batch::{Inference, PICTURES_ON_GPU};
pub use entry::*;
pub use fetch::FetchSource;
pub use manifest::{MANIFEST_FILE, Manifest};
pub use model::{Model, ModelError, Outputs, SessionKind, session, sha256_of};
pub use runtime::{LIBRARY, Runtime, TELEMETRY_OFF, find_library};
pub use source::{Conversion, ModelSource, PinnedFile, SourceFile, SourceKind};
pub use store::{AUTO, Fetched, ModelRequest, ModelState, ModelStore};
