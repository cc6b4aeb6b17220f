//! Tests of single modules of `orator-base`.

mod eigen;
mod exponential_map;
mod input;
mod lock;
mod skeleton;
mod sound;
