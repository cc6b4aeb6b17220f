//! How stages run, are recorded, and resume: a step is a `Stage`, its work item is a `Unit`, and finished work is
//! documented by a `record::Record`, which is written last. `artifacts` names the six stages and their files.

pub mod artifacts;
pub mod attempt;
pub mod fingerprint;
pub mod ledger;
pub mod overall;
pub mod parts;
pub mod progress;
pub mod record;
pub mod rejection;
pub mod runner;
pub mod unit;
pub mod workdir;
pub mod wrapper;

pub use unit::{Input, Report, Stage, Unit, write_json};
pub use wrapper::StageWrapper;
