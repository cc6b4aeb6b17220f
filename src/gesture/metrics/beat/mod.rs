//! Beat metrics: alignment of the beats of the motion with those of the sound.

pub mod aist;
pub mod angles;
pub mod consistency;
