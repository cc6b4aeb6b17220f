//! Verbs for datasets: `dataset`, `import`, `forget`, `align`.

pub mod align;
pub mod forget;
pub mod import;
pub mod verify;
