//! How any step of the road runs, is recorded, and resumes. This room knows no concrete step: a step is a `Stage`, a
//! thing to do is a `Unit`, and what was done is a `record::Record` written last.

pub mod fingerprint;
pub mod ledger;
pub mod progress;
pub mod record;
pub mod runner;
pub mod unit;
pub mod workdir;

pub use unit::Input;
pub use unit::Report;
pub use unit::Stage;
pub use unit::Unit;
pub use unit::counted;
pub use unit::write_json;
