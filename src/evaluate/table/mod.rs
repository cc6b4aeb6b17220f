//! Metrics with what stands beside them: sums over blocks, bootstrap intervals, the table, the file of a result, and
//! two results compared.

pub mod blocks;
pub mod bootstrap;
pub mod compare;
pub mod result;
pub mod table;
