//! From speech to gestures: training (`train`), generation (`generate`) of single sounds and of batches (`batch`),
//! metrics (`metrics`), the evaluation of trained models (`evaluate`), and gesture phases (`phases`).

pub mod batch;
pub mod evaluate;
pub mod export;
pub mod generate;
pub mod metrics;
pub mod phases;
pub mod train;
