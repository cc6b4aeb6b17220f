//! Joint positions to an animated avatar: rigs, retargeting and export (`animate`), and the software renderer (`render`).

pub mod animate;
pub mod render;
