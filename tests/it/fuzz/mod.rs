//! Readers of files on bytes that nobody wrote: the files of `fixtures/fuzz`, changed at random, one reader a test. No panic, no
//! long time, no memory out of proportion (`fixtures::fuzzing`). BOLERO_RANDOM_ITERATIONS is the number of
//! executions of each, BOLERO_RANDOM_SEED repeats one.

pub(crate) mod arrays;
pub(crate) mod corpus;
pub(crate) mod dataset;
pub(crate) mod media;
pub(crate) mod models;
pub(crate) mod motion;
pub(crate) mod texts;
pub(crate) mod weights;
