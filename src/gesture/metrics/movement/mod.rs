//! Metrics of how joints move: speed, acceleration, jerk, energy, distributions of speeds, correlation, bone changes.

pub mod angles;
pub mod bone_change;
pub mod cca;
pub mod derivatives;
pub mod hellinger;
