//! Readers of files on bytes that nobody wrote: the files of `fixtures/fuzz`, changed at random, one reader a test. No panic, no
//! long time, no memory out of proportion (`fixtures::fuzzing`). BOLERO_RANDOM_ITERATIONS is the number of
//! executions of each, BOLERO_RANDOM_SEED repeats one.

pub mod arrays;
pub mod corpus;
pub mod dataset;
pub mod media;
pub mod models;
pub mod motion;
pub mod texts;
pub mod weights;
