//! From speech to gestures: training (`train`), generation (`generate`) of single sounds and of batches (`batch`),
//! metrics (`metrics`), and the evaluation of trained models (`evaluate`).

pub mod batch;
pub mod evaluate;
pub mod export;
pub mod generate;
pub mod metrics;
pub mod train;
