//! Tests of single modules.

mod keypoint_frames;
