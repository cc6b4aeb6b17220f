//! `orator bench`: how fast a part of the road is, measured so that a noisy machine cannot flatter it: the variants take
//! turns, round after round, and the median round counts. One file a part.

pub mod animate;
pub mod child;
pub mod dataset;
pub mod evaluate;
pub mod generate;
pub mod lift;
pub mod lifter;
pub mod pose2d;
pub mod reference;
pub mod run;
pub mod scale;
pub mod spaces;
pub mod train;
pub mod verb;

pub use verb::median;
pub use verb::{Args, run};
