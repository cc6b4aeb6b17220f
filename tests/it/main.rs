//! The integration tests: one binary, a module a concern.

mod blender;
mod bvh;
mod clips;
mod dataset;
mod demo;
mod extract;
mod figures;
mod film;
mod footage;
mod gan;
mod generate;
mod golden;
mod house;
mod lift;
mod media_frames;
mod media_sound;
mod models_verb;
mod networks;
mod operators;
mod pose_chain;
mod pose_parity;
mod runner;
mod segment;
mod shard;
mod support;
