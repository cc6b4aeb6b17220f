//! The benchmark: `cargo bench -- PART`, one file a part. The variants of a part take turns, round after round, and the
//! median round counts, so that a noisy machine favours none of them. Without a part it lists them and ends.

pub(crate) mod bodies;
pub(crate) mod child;
pub(crate) mod claims;
pub(crate) mod cluster;
pub(crate) mod command;
pub(crate) mod dataset;
#[path = "../it/fixtures/disturbed.rs"]
pub(crate) mod disturbed;
pub(crate) mod evaluate;
pub(crate) mod generate;
pub(crate) mod lift;
pub(crate) mod pose2d;
pub(crate) mod reference;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod scale;
#[path = "../it/fixtures/study/served_study.rs"]
pub(crate) mod served_study;
pub(crate) mod spaces;
pub(crate) mod study;
pub(crate) mod training;
