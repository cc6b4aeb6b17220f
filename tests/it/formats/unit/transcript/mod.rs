//! Tests of single modules of `orator_formats::transcript`.

mod encoding;
mod marks;
mod tiers;
