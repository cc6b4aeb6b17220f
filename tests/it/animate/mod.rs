//! Rotations and animation files.

pub(crate) mod animate;
pub(crate) mod animate_verb;
pub(crate) mod bvh;
pub(crate) mod captured;
pub(crate) mod captured_body;
pub(crate) mod film;
pub(crate) mod foreign_bvh;
pub(crate) mod gltf;
pub(crate) mod motion_files;
pub(crate) mod noise;
pub(crate) mod posture;
pub(crate) mod rates;
pub(crate) mod renderer;
pub(crate) mod skeleton;
pub(crate) mod visibility;
