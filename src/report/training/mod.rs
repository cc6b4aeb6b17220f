//! Page of a training run: learning curves, and generated beside true poses.

pub mod charts;
pub mod live;
pub mod page;
pub mod strip;
