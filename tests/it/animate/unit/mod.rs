//! Tests of single modules of `orator-avatar`.

mod camera;
mod field;
mod file;
mod hinge;
mod jaw;
mod limits;
mod patch;
mod surface;
mod two_bone;
