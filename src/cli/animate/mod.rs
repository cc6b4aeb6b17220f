//! `orator animate`.

mod body_args;
mod film_args;
pub mod input;
mod report_text;
mod retarget_args;
pub mod verb;

pub use verb::{Args, run};
