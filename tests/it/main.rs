//! The integration tests: one binary, a module a concern.

mod house;
mod runner;
