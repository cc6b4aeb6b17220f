//! Tests of single modules of `orator_formats::mocap`.

mod fingers;
