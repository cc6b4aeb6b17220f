//! Several workers on one plan.

mod jobs;
mod long_video;
mod planted;
mod sealed;
mod timing;
mod workers;
