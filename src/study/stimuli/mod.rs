//! Films of a study: speech is cut into clips at pauses, the motions of all conditions are put on one rig with the same
//! visibility, and films are written so that only their motion reveals the condition.

pub mod condition_motion;
pub mod cut;
pub mod film;
pub mod filmed_speaker;
pub mod speaker_source;
