//! Several workers on one plan.

mod jobs;
mod long_video;
mod timing;
mod workers;
