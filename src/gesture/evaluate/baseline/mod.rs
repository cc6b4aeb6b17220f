//! Predictors that know less than a trained one: constant poses, the nearest neighbour by sound, mismatched motion.

pub mod baselines;
pub mod constant_pose;
pub mod neighbour;
pub mod predictor;
