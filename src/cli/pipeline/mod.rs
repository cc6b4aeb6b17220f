//! Verbs for a project folder: `init`, `run`, `status`, `report`.

pub mod init;
pub mod report;
pub mod run;
pub mod status;
