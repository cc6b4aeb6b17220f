//! The page of a training: its curves, and generated beside true poses.

pub mod charts;
pub mod page;
pub mod picture;
pub mod strip;
