//! How any stage runs, is recorded, and resumes: a step is a `Stage`, what it works on is a `Unit`, and what was done is a
//! `record::Record` written last. `artifacts` has the names of the five stages and of their files.

pub mod artifacts;
pub mod attempt;
pub mod fingerprint;
pub mod ledger;
pub mod overall;
pub mod parts;
pub mod progress;
pub mod record;
pub mod refusal;
pub mod runner;
pub mod unit;
pub mod workdir;
pub mod wrapper;

pub use unit::{Input, Report, Stage, Unit, counted, write_json};
pub use wrapper::StageWrapper;
