//! Tests of single modules of `orator-gesture`.

mod constant_pose;
mod fixed_rate;
mod labels;
mod pck;
mod score;
