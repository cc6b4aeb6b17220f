//! The avatar: a skinned figure of our own, made from the figure's bones. Its form is a distance field around the
//! bones in a stance near to what speakers do; surfaces, weights, and the way back to the T-pose follow from it.

pub mod avatar;
pub mod body;
pub mod field;
pub mod hand;
pub mod skin;
pub mod stance;
pub mod surface;

pub use avatar::Avatar;
pub use avatar::AvatarMesh;
pub use avatar::Material;
pub use skin::Weights;
