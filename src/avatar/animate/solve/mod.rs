//! Joint positions to joint rotations: arms, roll, head, hands, and their smoothing.

pub mod arm;
pub mod arm_pose;
pub mod head;
pub mod legs;
pub mod positions;
pub mod roll;
pub mod smoothing;
pub mod track;
pub mod trunk;
