//! Several workers on one plan.

mod blocked_paths;
mod changed_videos;
mod forget;
mod jobs;
mod long_video;
mod sealed_input;
mod shared_folder;
mod simulation;
mod unit;
mod workers;
