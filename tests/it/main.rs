//! The integration tests: one binary, a module a concern.

mod dataset;
mod house;
mod runner;

mod blender;
mod bvh;
mod figures;

mod clips;
mod media_frames;
mod media_sound;
