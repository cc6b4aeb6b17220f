//! The pipeline as a value (`pipeline`, run by `run`, looked at by `status`), its five stages, how the `pictures` of its
//! videos are read, what their `sound` tells of loudness, `lips` of whose voice it is and a `portrait` of who is seen, one
//! `claimed_video` of a worker among many, and speech to motion files in batches. The stages never import each other: they
//! meet in the files that they write. `keypoints` stands in for the first two where other programs looked at the pictures.

pub mod account;
pub mod claimed_video;
pub mod dataset;
pub mod extract;
pub mod keypoints;
pub mod lift;
pub mod lips;
pub mod pictures;
pub mod pipeline;
pub mod portrait;
pub mod pose2d;
pub mod process;
pub mod run;
pub mod segment;
pub mod selection;
pub mod sound;
pub mod stages;
pub mod status;
pub mod timing;
pub mod watched_stage;

pub use account::{AccountKind, TimeAccount};
pub use pipeline::Pipeline;
pub use run::{RunReport, RunState, StageCounts, UnitFailure, UnitReport};
pub use selection::Selection;
pub use status::{StagePlan, StatusReport, UnitState, UnitStatus};
