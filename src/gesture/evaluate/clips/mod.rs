//! Clips to evaluate: from pairs of files or from held-out intervals with generated motion, and their sound features.

pub mod checkpoint;
pub mod clips;
pub mod from_checkpoints;
pub mod held_out;
pub mod motion_store;
pub mod pairs;
pub mod sound_features;
