//! Stage 2: frames to 2D keypoints of the one speaker: person box, body, both hands, tracked through each shot.
//! `decode` reads the models' outputs, one file a kind; `detector`, `body` and `hand` ask the models; `speaker`
//! says who is tracked, with `tracker` (the choice), `liveness` and `appearance` (on a `patch` of the picture); `region`
//! and `hands` say where to look for a hand and when; `face` sees the mouth, `talker` finds whose mouth the voice is of;
//! `chain` is the way of one frame, `span` that of a part of a video; `stage` joins the parts.

pub mod appearance;
pub mod body;
pub mod chain;
pub mod decode;
pub mod detector;
pub mod face;
pub mod hand;
pub mod hands;
pub mod liveness;
pub mod model_input;
pub mod models;
pub mod patch;
pub mod region;
pub mod span;
pub mod speaker;
pub mod stage;
pub mod talker;
pub mod tracker;

pub use chain::Chain;
pub use stage::Pose2dStage;
