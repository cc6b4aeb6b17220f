//! Skinned avatar of a rig: distance fields (`field`, `body`, `hand`), their surfaces, the stance they are built in,
//! and skinning weights.

pub mod avatar;
pub mod body;
pub mod field;
pub mod hand;
pub mod skin;
pub mod stance;
pub mod surface;

pub use avatar::{Avatar, AvatarMesh, Material};
pub use skin::Weights;
