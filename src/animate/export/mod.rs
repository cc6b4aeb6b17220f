//! Files that other programs open: GLB, JSON, MP4, and the choice of format by file name.

pub mod file;
pub mod film;
pub mod film_avatar;
pub mod film_panel;
pub mod film_source;
pub mod glb;
pub mod glb_scene;
pub mod json;
