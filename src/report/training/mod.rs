//! Page of a training run: learning curves, and generated and true poses.

pub mod charts;
pub mod live;
pub mod strip;
