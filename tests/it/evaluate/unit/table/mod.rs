//! Tests of single modules of `orator_gesture::evaluate::table`.

mod blocks;
mod bootstrap;
mod sign_flips;
