//! Retargeting to a user's own skeleton: the mapping of its joints to ours, and rotations that reproduce our bone
//! directions and wrist positions.

pub mod bone_map;
pub mod bvh_rig;
pub mod captured_body;
pub mod glb_rig;
pub mod retargeted;
pub mod transfer;
pub mod two_bone;
pub mod user_rig;
