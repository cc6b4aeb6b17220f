//! Tests of single modules of `orator_dataset::config`.

mod keypoints;
mod videos;
