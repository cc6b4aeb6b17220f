//! Metric values with their context: sums over blocks, bootstrap intervals, the table, the result file, and the
//! comparison of two results.

pub mod blocks;
pub mod bootstrap;
pub mod compare;
pub mod result;
pub mod table;
