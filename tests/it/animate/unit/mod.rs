//! Tests of single modules of `orator-avatar`.

mod avatar;
mod camera;
mod export;
mod field;
mod file;
mod file_skeleton;
mod hinge;
mod jaw;
mod limits;
mod names;
mod patch;
mod retarget;
mod solve;
mod surface;
mod two_bone;
