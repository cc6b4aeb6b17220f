//! Stage 3: keypoints to intervals worth keeping. `measure` and `rest` and, by `speech_rule`,
//! `speech_activity` turn what the stages before wrote into a few numbers a frame (`store` keeps them), `table` has the
//! rules, a row each, `judge` applies them, `stage` reads and writes the files.

pub mod judge;
pub mod measure;
pub mod rest;
pub mod speech_activity;
pub mod speech_rule;
pub mod stage;
pub mod store;
pub mod table;

pub use judge::judge;
pub use measure::Measures;
pub use stage::SegmentStage;
