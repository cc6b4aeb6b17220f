//! The integration tests: one binary, a module a concern.

mod dataset;
mod house;
mod runner;

mod blender;
mod bvh;
mod figures;
