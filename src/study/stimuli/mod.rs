//! Films of a study: speech is cut into clips at its pauses, each condition's motion of a clip is put on one rig under one
//! mask, and each film is written so that nothing but its motion tells the condition.

pub mod alike;
pub mod condition_motion;
pub mod cut;
pub mod film;
pub mod filmed;
pub mod speaker_source;
