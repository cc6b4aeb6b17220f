//! What stands on the report of a speaker's videos. Gathered, a file an idea: `video` (the verdict on each), `what_if` (what
//! other `thresholds` would keep), `spread` (how often each value was measured), `movement` (where joints are and how fast),
//! `worst` and `pictures` (frames that show what a rule refuses); `gather` goes through the videos once and fills them all.
//! Shown, a file a section: `summary`, `lines`, `gallery`, `distributions`, `sliders`, `motion`; `whole` puts them on a page.
//!
//! And what stands on the page of a training: `training`, of `training_charts`, `training_strip`, `training_picture`; and on that
//! of an evaluation: `evaluation`, of `evaluation_table`, `evaluation_charts`, `evaluation_player`.

mod distributions;
pub mod evaluation;
mod evaluation_charts;
mod evaluation_player;
mod evaluation_table;
mod gallery;
mod gather;
mod lines;
mod motion;
mod movement;
mod pictures;
mod reasons;
mod sliders;
mod spread;
mod summary;
mod thresholds;
pub mod training;
mod training_charts;
mod training_picture;
pub mod training_strip;
mod video;
mod what_if;
mod whole;
mod worst;

pub use summary::Sums;
pub use whole::{Made, Wanted, make};
