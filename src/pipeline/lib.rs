//! The pipeline as a value (`pipeline`, run by `run`, looked at by `status`), its five stages, the `sound` of its videos, whose
//! voice it is by the `lips`, a `portrait` of the person, and one `claimed_video` of a worker among many. The stages never
//! import each other: they meet in the files that they write. `keypoints` stands in for the first two where other programs looked at the pictures.

pub mod account;
pub mod claimed_video;
pub mod dataset;
pub mod extract;
pub mod keypoints;
pub mod lift;
pub mod lips;
pub mod pipeline;
pub mod portrait;
pub mod pose2d;
pub mod process;
pub mod run;
pub mod segment;
pub mod sound;
pub mod stages;
pub mod status;
pub mod timing;

pub use account::{AccountKind, TimeAccount};
pub use pipeline::Pipeline;
pub use run::{RunReport, RunState, Selection, StageCounts, UnitFailure, UnitReport};
pub use status::{StagePlan, StatusReport, UnitState, UnitStatus};

#[cfg(test)]
mod test_keypoints;
