//! Rendered people as a labelled set: `person` (what is labelled of somebody), `folder` (pictures and annotations).

pub mod folder;
pub mod person;
