//! Results compared with independent references: golden values from committed scripts, and real clips.

pub(crate) mod face_parity;
pub(crate) mod gan_losses_parity;
pub(crate) mod generator_parity;
pub(crate) mod golden;
pub(crate) mod heatmap_parity;
pub(crate) mod lifter_parity;
pub(crate) mod packages;
pub(crate) mod pose_parity;
pub(crate) mod real_clips;
pub(crate) mod seq2seq_parity;
pub(crate) mod whisper_parity;
