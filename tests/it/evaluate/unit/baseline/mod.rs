//! Tests of single modules of `orator_gesture::evaluate::baseline`.

mod baselines;
