//! Errors of the complete pipeline on rendered persons: `points` (2D keypoints), `hands` (missed, false positives,
//! other hand, swapped), `hand_depth` (of the hand model), `head` (angles), `accepted` (intervals and mask), `joints`
//! (3D), `table` (all errors by condition or source of motion, and model set), `difference` (captured and generated
//! motion), `grid` (the table as text), `page` (as HTML) and `keypoint_statistics` (comparison with real clips).
//! `noise` and `hand_noise` with `bias_fit`: the errors as the noise model with which lifters are trained.

pub mod accepted;
pub mod bias_fit;
pub mod clips;
pub mod difference;
pub mod grid;
pub mod hand_depth;
pub mod hand_noise;
pub mod hands;
pub mod head;
pub mod joints;
pub mod keypoint_statistics;
pub mod noise;
pub mod page;
pub mod points;
pub mod table;
