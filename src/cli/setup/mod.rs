//! The verbs of an installation: `models`, `doctor`, `guide`, `completions`, `man`.

pub mod completions;
pub mod doctor;
pub mod guide;
pub mod models;
