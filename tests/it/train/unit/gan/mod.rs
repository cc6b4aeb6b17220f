//! Tests of single modules of `orator_gesture::train::gan`.

mod augment;
mod recipe;
mod speakers;
