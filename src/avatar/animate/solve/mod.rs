//! Joint positions to joint rotations: arms, upper arm roll, hands, head, trunk, legs, and their smoothing.

pub mod arm;
pub mod arm_pose;
pub mod hand_fit;
pub mod head;
pub mod legs;
pub mod positions;
pub mod reach;
pub mod roll;
pub mod smoothing;
pub mod track;
pub mod trunk;
