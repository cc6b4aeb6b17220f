//! Verbs for datasets: `dataset`, `import`, `forget`, `transcribe`, `align`.

pub mod align;
mod aligned_text;
pub mod annotate;
pub mod forget;
pub mod import;
pub mod transcribe;
pub mod verify;
