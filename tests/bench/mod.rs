//! The benchmark: `cargo bench -- PART`, one file a part. The variants of a part take turns, round after round, and the
//! median round counts, so that a noisy machine favours none of them. Without a part it lists them and ends.

pub mod bodies;
pub mod child;
pub mod claims;
pub mod cluster;
pub mod command;
pub mod dataset;
#[path = "../it/fixtures/disturbed.rs"]
pub mod disturbed;
pub mod evaluate;
pub mod generate;
pub mod lift;
pub mod pose2d;
pub mod reference;
pub mod report;
pub mod run;
pub mod scale;
#[path = "../it/fixtures/study/served_study.rs"]
pub mod served_study;
pub mod spaces;
pub mod study;
pub mod training;
