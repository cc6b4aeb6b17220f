//! `orator animate`.

mod film_args;
pub mod input;
pub mod verb;

pub use verb::{Args, run};
