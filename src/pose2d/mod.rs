//! Stage 2: frames to 2D keypoints of the one speaker: person box, body, both hands, followed through each shot.
//! `decode` reads the models' outputs, one file a kind; `person`, `body`, `hand` and `palm` ask one model each; `region`
//! says where to look for a hand; `chain` is the way of one frame; `stage` the way of a video.

mod body;
mod chain;
pub mod decode;
mod feed;
mod hand;
mod palm;
mod person;
mod region;
mod stage;
pub mod store;

pub use chain::Chain;
pub use stage::Pose2dStage;
