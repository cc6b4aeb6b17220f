//! Verbs for datasets: `dataset`, `import`, `forget`, `transcribe`.

mod aligned_text;
pub mod forget;
pub mod import;
pub mod transcribe;
pub mod verify;
