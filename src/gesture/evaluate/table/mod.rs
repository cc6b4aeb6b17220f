//! The table of metrics: sums over blocks that are long enough to be independent, bootstrap intervals, sign-flip tests
//! of paired differences, the result file, and the comparison of two results.

pub mod blocks;
pub mod bootstrap;
pub mod compare;
pub mod result;
pub mod sign_flips;
pub mod table;
