//! Skinned avatar of a rig: appearance, distance fields (`field`, `body`, `hand`, `head`), their surfaces, the stance
//! in which they are built, skinning weights, and poses.

pub mod appearance;
pub mod assembly;
pub mod avatar;
pub mod body;
pub mod face;
pub mod field;
pub mod garments;
pub mod hand;
pub mod head;
pub mod jaw;
pub mod material;
pub mod patch;
pub mod posing;
pub mod skin;
pub mod stance;
pub mod surface;

pub use appearance::Appearance;
pub use avatar::{Avatar, AvatarMesh};
pub use material::Material;
pub use skin::Weights;
