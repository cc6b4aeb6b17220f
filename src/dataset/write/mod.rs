//! The dataset written: tar shards of a video, its part, and the whole put together.

pub mod assemble;
pub mod part;
pub mod tar;
pub mod writer;
