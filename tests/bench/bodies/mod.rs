//! Bodies: joints as animation files, and the avatar as pictures.

pub(crate) mod animate;
pub(crate) mod render;
