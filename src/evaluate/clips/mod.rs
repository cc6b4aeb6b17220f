//! What is evaluated: pairs of files, held-out intervals of a dataset with the motion that a checkpoint generates, and
//! the sound features of both.

pub mod clips;
pub mod held_out;
pub mod of_speaker;
pub mod pairs;
pub mod sound_features;
