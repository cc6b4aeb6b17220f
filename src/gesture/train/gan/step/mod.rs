//! Steps of the training of a generator and its discriminator, on the CPU (`trainer`) or on a GPU (`on_device`), with the
//! random numbers of a step (`batch`) and its losses (`loss_log`).

mod batch;
mod loss_log;
mod on_device;
mod trainer;

pub use batch::StepBatch;
pub use loss_log::Losses;
pub use trainer::{GanTrainer, MAX_NORM, TrainerState};
