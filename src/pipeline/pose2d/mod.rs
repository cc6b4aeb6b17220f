//! Stage 2: frames to 2D keypoints of the one speaker: person box, body, both hands, tracked through each shot.
//! `decode` reads the models' outputs, one file a kind; `tracking` finds people and says who is the speaker; `body`,
//! `hand` and `palm` ask one model each; `sides` undoes swapped sides; `region` and `hands` say where to look for a hand
//! and when; `chain` is the way of one frame; `stage` the way of a video.

pub mod body;
pub mod chain;
pub mod decode;
pub mod hand;
pub mod hands;
pub mod model_input;
pub mod models;
pub mod palm;
pub mod region;
pub mod sides;
pub mod stage;
pub mod store;
pub mod tracking;

pub use chain::Chain;
pub use stage::Pose2dStage;
