//! `orator animate`.

mod film_args;
pub mod input;
mod smoothing_args;
pub mod verb;

pub use verb::{Args, run};
