//! Baseline predictors: constant poses, the nearest neighbour by sound, and mismatched motion.

pub mod baselines;
pub mod constant_pose;
pub mod predictor;
