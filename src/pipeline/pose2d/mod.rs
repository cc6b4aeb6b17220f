//! Stage 2: 2D keypoints of the one speaker in each frame: person box, body, both hands, tracked through each shot.
//! `decode` decodes the model outputs, one file per kind; `detector`, `body` and `hand` run the models; `speaker`
//! decides who is tracked, with `tracker` (choice), `chosen_person` (choice of a user), `liveness` and `appearance` (both
//! on a `patch` of the picture); `region` and `hands` locate hands; `face` measures the mouth, `talker` finds the active
//! speaker; `chain` processes a frame, `span` a part of a video; `stage` joins the parts.

pub mod appearance;
pub mod body;
pub mod chain;
pub mod chosen_person;
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
