//! Metrics of beats: how well those of the motion fall on those of the sound.

pub mod aist;
pub mod angles;
pub mod consistency;
