//! Metric values with their context: sums over blocks that are long enough to be independent, bootstrap intervals, tests
//! of paired differences by sign flips, the table, the result file, and the comparison of two results.

pub mod block_length;
pub mod blocks;
pub mod bootstrap;
pub mod compare;
pub mod left_out;
pub mod result;
pub mod sign_flips;
pub mod table;
