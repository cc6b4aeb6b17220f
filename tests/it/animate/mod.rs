//! Rotations and animation files.

pub mod animate;
pub mod animate_verb;
pub mod bvh;
pub mod captured;
pub mod film;
pub mod gltf;
pub mod motion_files;
pub mod posture;
pub mod rates;
