//! Animation of joint positions: rigs, rotations, avatars, exported files (BVH, GLB, FBX, MP4).

pub mod avatar;
pub mod draw;
pub mod export;
pub mod performance;
pub mod retarget;
pub mod rig;
pub mod solve;

pub use draw::figure::{FigureView, draw_pose};
pub use performance::{AnimationOptions, Performance, Yaw, perform, perform_captured};
pub use rig::constraints::Constraints;
pub use solve::legs::Legs;
pub use solve::smoothing::Smoothing;
