//! Tests of single modules of `orator-gesture`.

mod baseline;
mod clips;
mod constant_pose;
mod fixed_rate;
mod labels;
mod metrics;
mod pck;
mod score;
mod table;
