//! Integration tests of `orator-lab`. Some run `orator`, which must be built in the same target folder.

mod captured;
mod demo;
mod lifter;
mod people;
mod rule;
