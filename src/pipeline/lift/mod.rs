//! Stage 4: 2D keypoints to 3D joints. Per interval: `observed` (visible points without outliers) -> `body` (with
//! `hand_direction`) and `hands` (the networks, `hand_depth`) -> smoothing; then `lengths` (one set per video) -> `camera` (levelling on
//! request) -> bone lengths applied, hands attached to the wrists. A joint hidden for up to a second is filled and
//! masked; one missing for longer is NaN, with its descendants. Size is a convention (`upper_body::REFERENCE_SIZE`).
//! `reject` rejects frames in which lifting reveals errors.

pub mod body;
pub mod camera;
pub mod gaps;
pub mod hand_depth;
pub mod hand_direction;
pub mod hands;
pub mod lengths;
pub mod lifter;
pub mod observed;
pub mod outliers;
pub mod reject;
pub mod rest;
pub mod stage;
pub mod weights;

pub use camera::CameraTilt;
pub use lifter::{Lifted, Lifter, notes};
pub use stage::LiftStage;
