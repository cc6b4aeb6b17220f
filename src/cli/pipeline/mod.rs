//! Verbs for a project folder: `init`, `run` (with `train` for `--train`), `status`, `report`.

pub mod init;
pub mod report;
pub mod run;
pub mod status;
mod train;
