//! Stage 3: keypoints to accepted intervals. `measure` and `rest` compute per-frame measures from the outputs of earlier
//! stages (`store` saves them), `table` defines the rules, `judge` applies them and decisions of users, `stage` reads and
//! writes the files.

pub mod judge;
pub mod measure;
pub mod rest;
pub mod stage;
pub mod store;
pub mod table;

pub use judge::judge;
pub use measure::Measures;
pub use stage::SegmentStage;
