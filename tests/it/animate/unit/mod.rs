//! Tests of single modules of `orator-avatar`.

mod camera;
mod hinge;
mod surface;
