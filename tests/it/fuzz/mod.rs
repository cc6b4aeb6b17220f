//! Fuzz tests of the file readers, one test per reader: random mutations of the files in `fixtures/fuzz` must not cause
//! a panic, a long run time or excessive memory use (`fixtures::fuzzing`). BOLERO_RANDOM_ITERATIONS sets the number of
//! executions per test, BOLERO_RANDOM_SEED reproduces one.

pub(crate) mod arrays;
pub(crate) mod corpus;
pub(crate) mod dataset;
pub(crate) mod media;
pub(crate) mod models;
pub(crate) mod motion;
pub(crate) mod texts;
pub(crate) mod weights;
