//! Joints to rotations, and the files people open: BVH, GLB, MP4, contact sheets.

pub mod avatar;
pub mod draw;
pub mod export;
pub mod performance;
pub mod rig;
pub mod solve;

pub use draw::figure::FigureView;
pub use draw::figure::draw_pose;
pub use performance::AnimationOptions;
pub use performance::Performance;
pub use performance::Yaw;
pub use performance::perform;
pub use rig::constraints::Constraints;
pub use solve::head::Face;
pub use solve::smoothing::Smoothing;
