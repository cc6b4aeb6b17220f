//! Stage 4: 2D keypoints to 3D joints, for each interval `observed` (what is seen, strays out) -> `body` and `hands` (the
//! networks, `hand_depth`) -> smoothing -> `lengths` (one set for the whole video) -> `camera` (levelled on request) -> every
//! bone given its length, hands joined at the wrists, all in place in the arrays that come out. A joint not seen for up to
//! a second is filled and masked; one missing for longer is NaN, with all that hangs on it. Size is a convention
//! (`upper_body::REFERENCE_SIZE`), as no picture tells it. `refuse` takes frames out that lifting shows to be wrong.

pub mod body;
pub mod camera;
pub mod gaps;
pub mod hand_depth;
pub mod hands;
pub mod lengths;
pub mod lifter;
pub mod observed;
pub mod outliers;
pub mod quality;
pub mod refuse;
pub mod rest;
pub mod stage;
pub mod weights;

pub use camera::CameraTilt;
pub use lifter::{Lifted, Lifter, notes};
pub use stage::LiftStage;
