//! BVH files: reader, writer, and conversion to exponential maps.

pub mod exponential_maps;
pub mod read;
pub mod skeleton;
pub mod write;
