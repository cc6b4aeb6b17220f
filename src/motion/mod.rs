//! Motion as numbers: forward kinematics, rotations, Procrustes, smoothing, bone lengths; readers and writers of motion files. Pure but for those files.

pub mod authors_txt;
pub mod bvh_write;
pub mod fk;
pub mod npy;
pub mod rotation;
pub mod vec3;
