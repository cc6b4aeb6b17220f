//! Pipeline from videos to datasets: the six stages and the API that runs them (`pipeline`, `run`, `status`), audio
//! extraction (`sound`), detection of speech (`speech`), synchrony of lips and voice (`lip_sync`), a description of the person's face and colours
//! (`portrait`), and `claimed_video`, which processes one video for a cluster worker. Stages never import each other;
//! they communicate only through the files that they write. `keypoints` replaces the first two stages where the
//! keypoints come from another program.

pub mod claimed_video;
pub mod dataset;
pub mod extract;
pub mod keypoints;
pub mod lift;
pub mod lip_sync;
pub mod pipeline;
pub mod portrait;
pub mod pose2d;
pub mod process;
pub mod run;
pub mod segment;
pub mod sound;
pub mod speech;
pub mod stages;
pub mod stale_results;
pub mod status;
pub mod time_budget;
pub mod timing;
pub mod transcribe;

pub use pipeline::Pipeline;
pub use run::{RunReport, RunState, Selection, StageCounts, UnitFailure, UnitReport};
pub use stale_results::{ModelStatus, StaleResult};
pub use status::{StagePlan, StatusReport, UnitState, UnitStatus};
pub use time_budget::{BudgetKind, TimeBudget};

#[cfg(test)]
mod test_keypoints;
