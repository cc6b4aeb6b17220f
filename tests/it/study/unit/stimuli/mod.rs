//! Tests of single modules of `orator_study::stimuli`.

mod condition_motion;
mod filmed_speaker;
