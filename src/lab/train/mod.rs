//! Training of the body and hand lifters and of the metric spaces on synthetic and captured motion.

pub mod lifter;
pub mod scene;
pub mod space;
pub mod supervised;
