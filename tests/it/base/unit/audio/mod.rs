//! Tests of single modules of `orator_base::audio`.

mod onset;
mod pauses;
