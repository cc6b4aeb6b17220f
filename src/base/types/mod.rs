//! Plain values every room speaks: time, pictures, poses, sound, intervals. No files, no maths beyond their own
//! invariants; this room imports nothing of the project.

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
