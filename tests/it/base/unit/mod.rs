//! Tests of single modules of `orator-base`.

mod artifacts;
mod audio;
mod cholesky;
mod eigen;
mod exponential_map;
mod file_name;
mod fingerprint;
mod fk;
mod foreign_program;
mod image;
mod input;
mod jerk;
mod lock;
mod math;
mod motion;
mod skeleton;
mod sound;
mod upper_body;
