//! Joints to rotations, and the files people open: BVH, MP4, contact sheets.

pub mod draw;
pub mod figure;
pub mod file;
pub mod overlay;
pub mod performance;
pub mod rotations;
pub mod sheet;
pub mod sheet_cells;
pub mod strip;
pub mod video;

pub use draw::{View, draw_pose};
pub use performance::{Face, Options, Performance, perform};
