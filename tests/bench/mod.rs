//! The benchmark: `cargo bench -- PART`, one file per part. Each round measures all variants of a part, and the median
//! over the rounds is reported, so that noise affects all variants alike. Without a part it prints the help.

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
