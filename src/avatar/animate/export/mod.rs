//! Files for other programs: FBX, GLB, VRM, SMPL-X, JSON, MP4, and the choice of format by file extension.

pub mod fbx;
pub mod file;
pub mod film;
pub mod film_avatar;
pub mod film_source;
pub mod glb;
pub mod glb_scene;
pub mod json;
pub mod smplx;
pub mod vrm;
