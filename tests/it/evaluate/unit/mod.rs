//! Tests of single modules of `orator-gesture`.

mod fixed_rate;
mod labels;
mod score;
