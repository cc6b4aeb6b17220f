//! Integration tests of `orator-lab`. Those of `orator run` on what it draws need the program `orator` built beside it.

mod demo;
mod lifter;
mod people;
mod rule;
