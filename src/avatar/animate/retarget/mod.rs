//! Motion on a user's own skeleton: which of its joints is which of ours, and rotations that put its bones in our
//! directions and its hands at our places.

pub mod bone_map;
pub mod bone_names;
pub mod bvh_rig;
pub mod glb_rig;
pub mod reach;
pub mod retargeted;
pub mod transfer;
pub mod user_rig;
