//! Tests of single modules of `orator_dataset::import`.

mod find;
