//! Tests of single modules of `orator_gesture::batch`.

mod sounds;
