//! `orator generate`.

pub mod batch;
pub mod made;
pub mod table;
pub mod verb;

pub use verb::{Args, run};
