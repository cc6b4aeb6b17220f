//! Tests of single modules of `orator_avatar::animate::avatar`.

mod posing;
