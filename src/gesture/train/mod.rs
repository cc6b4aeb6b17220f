//! Losses, optimiser, checkpoints, logs, and the training loops.
//!
//! Data flow of the GAN: `gan::windows` (dataset to normalised poses and log-mels) -> `gan::step` (networks, `losses`,
//! `optim`) -> checkpoint. `gan::train` starts or resumes a training, `epochs` is the loop, and `gan::validate` and
//! `gan::score` choose the best checkpoint. `seq2seq` has the same structure.

pub mod epochs;
pub mod gan;
pub mod log;
pub mod no_window;
pub mod optim;
pub mod resume;
pub mod seq2seq;
pub mod word_vectors;
