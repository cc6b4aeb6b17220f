//! Tests of single modules of `orator_formats::bvh`.

mod frame_time;
mod read;
