//! `orator animate`.

mod body_args;
mod film_args;
pub mod input;
mod retarget_args;
mod smoothing_args;
mod told;
pub mod verb;

pub use verb::{Args, run};
