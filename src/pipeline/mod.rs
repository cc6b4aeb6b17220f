//! The five stages. They never import each other: they meet in the files that they write.

pub mod dataset;
pub mod extract;
pub mod lift;
pub mod pose2d;
pub mod segment;
