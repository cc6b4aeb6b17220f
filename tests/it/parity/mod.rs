//! Numbers held to independent references: golden values from committed scripts, and real clips.

pub mod face_parity;
pub mod generator_parity;
pub mod golden;
pub mod heatmap_parity;
pub mod lifter_parity;
pub mod packages;
pub mod pose_parity;
pub mod real;
pub mod seq2seq_parity;
