//! The verbs of a dataset: `dataset`, `import`, `forget`.

pub mod forget;
pub mod import;
pub mod verify;
