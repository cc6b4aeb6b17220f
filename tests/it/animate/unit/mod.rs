//! Tests of single modules of `orator-avatar`.

mod camera;
mod field;
mod file;
mod file_skeleton;
mod hinge;
mod jaw;
mod limits;
mod names;
mod patch;
mod surface;
mod two_bone;
