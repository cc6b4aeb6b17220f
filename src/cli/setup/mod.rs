//! Verbs for the installation: `models`, `words`, `doctor`, `guide`, `completions`, `man`.

pub mod completions;
pub mod doctor;
pub mod models;
pub mod words;
