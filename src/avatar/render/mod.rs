//! Software renderer: posed triangle meshes through a pinhole camera, with identical bytes on every machine.

pub mod background;
pub mod camera;
pub mod light;
pub mod pixel;
pub mod renderer;
pub mod samples;
pub mod shadow;
pub mod srgb;
pub mod surfaces;
pub mod visibility;

pub use background::Background;
pub use camera::PinholeCamera;
pub use light::Light;
pub use renderer::Renderer;
pub use srgb::Srgb;
pub use surfaces::Mesh;
