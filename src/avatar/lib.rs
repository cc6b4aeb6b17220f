//! From joint positions to an animated avatar: rigs, retargeting and export (`animate`), software renderer (`render`).

pub mod animate;
pub mod render;
