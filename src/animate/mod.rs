//! Joints to rotations, and the files people open: BVH, GLB, MP4, contact sheets.

pub mod arm;
pub mod avatar;
pub mod constraints;
pub mod draw;
pub mod figure;
pub mod file;
pub mod glb;
pub mod glb_scene;
pub mod head;
pub mod hinge;
pub mod json;
pub mod limits;
pub mod names;
pub mod overlay;
pub mod performance;
pub mod places;
pub mod pose;
pub mod roll;
pub mod rotations;
pub mod sheet;
pub mod sheet_cells;
pub mod smoothing;
pub mod strip;
pub mod track;
pub mod video;

pub use constraints::Constraints;
pub use draw::{View, draw_pose};
pub use head::Face;
pub use performance::{Options, Performance, Yaw, perform};
pub use smoothing::Smoothing;
