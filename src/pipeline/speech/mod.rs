//! Speech detection for the stages `segment` and `transcribe`: `speech_rule` chooses the detector and `speech_activity`
//! applies its model.

pub mod speech_activity;
pub mod speech_rule;
