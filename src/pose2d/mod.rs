//! Stage 2: frames to 2D keypoints of the one speaker: person box, body, both hands, followed through each shot.
//! `decode` reads the models' outputs, one file a kind; `person`, `body`, `hand` and `palm` ask one model each; `speaker`
//! says who is followed, with `followed` (the choice), `liveness` and `appearance` (on a `patch` of the picture); `region`
//! says where to look for a hand; `chain` is the way of one frame; `stage` the way of a video.

mod appearance;
mod body;
mod chain;
pub mod decode;
mod feed;
mod followed;
mod hand;
mod liveness;
mod palm;
mod patch;
mod person;
mod region;
mod speaker;
mod stage;
pub mod store;

pub use chain::Chain;
pub use stage::Pose2dStage;
