//! What stands on the report of a speaker's videos. Gathered, a file an idea: `video` (the verdict on each), `what_if` (what
//! other `thresholds` would keep), `spread` (how often each value was measured), `movement` (where joints are and how fast),
//! `worst` and `pictures` (frames that show what a rule refuses); `gather` goes through the videos once and fills them all.
//! Shown, a file a section: `summary`, `lines`, `gallery`, `distributions`, `sliders`, `motion`; `whole` puts them on a page.
//!
//! And what stands on the page of a training: `training`, of `training_charts`, `training_strip`, `training_picture`; and on that
//! of an evaluation: `evaluation`, of `evaluation_table`, `evaluation_charts`, `evaluation_player`.

pub mod evaluation;
pub mod html;
pub mod sheet;
pub mod training;
pub mod videos;

pub use videos::page::ReportPage;
pub use videos::page::ReportRequest;
pub use videos::page::make;
pub use videos::summary::ReportTotals;
