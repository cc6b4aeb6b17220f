//! Bodies: joints as animation files, and the avatar as pictures.

pub mod animate;
pub mod render;
