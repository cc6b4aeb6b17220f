//! Software renderer: posed triangle meshes seen by a pinhole camera, with the same bytes on every machine.

pub mod camera;
pub mod mesh;

pub use camera::PinholeCamera;
pub use mesh::Mesh;
