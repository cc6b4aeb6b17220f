//! Tests of single modules of `orator_study::design`.

mod clip_scheduler;
