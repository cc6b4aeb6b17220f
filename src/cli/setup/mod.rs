//! The verbs of an installation: `models`, `doctor`.

pub mod doctor;
pub mod models;
