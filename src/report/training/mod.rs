//! Page of a training: curves, and generated beside true poses.

pub mod charts;
pub mod live;
pub mod page;
pub mod strip;
