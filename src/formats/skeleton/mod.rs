//! Joints of any skeleton (BVH, GLB, VRM) matched to the bones of ours: by name in the conventions of other programs,
//! or else by the structure of the skeleton.

pub mod joint_names;
pub mod matched;
mod structure;
