//! Tests of single modules of `orator_study::pages`.

mod assets;
