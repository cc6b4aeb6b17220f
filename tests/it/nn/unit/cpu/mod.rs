//! Tests of single modules of `orator_nn::cpu`.

mod vectorised;
