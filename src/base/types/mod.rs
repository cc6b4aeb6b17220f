//! Plain values used by all modules: time, pictures, poses, sound, intervals. No file access, no mathematics beyond
//! their own invariants; this module imports no other module of the project.

pub mod device;
pub mod file_name;
pub mod image;
pub mod interval;
pub mod pose2d;
pub mod pose3d;
pub mod posture;
pub mod skeleton;
pub mod sound;
pub mod split;
pub mod time;
