//! Tests of single modules of `orator_gesture::evaluate::clips`.

mod sound_features;
