//! What a plan takes: the stages are timed on excerpts (`timing`, `process_memory`), with the settings and with others
//! (`menu`); `stage_times` says what that means for whole videos, `wall` for several workers.

pub mod menu;
pub mod process_memory;
pub mod stage_times;
pub mod timing;
pub mod wall;
