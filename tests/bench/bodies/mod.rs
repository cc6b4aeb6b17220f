//! Benchmarks of animation: export of joints to animation files, and rendering of the avatar.

pub(crate) mod animate;
pub(crate) mod render;
