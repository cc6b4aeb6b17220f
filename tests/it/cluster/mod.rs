//! Several workers on one plan.

mod blocked_paths;
mod changed_videos;
mod jobs;
mod long_video;
mod simulation;
mod timing;
mod workers;
