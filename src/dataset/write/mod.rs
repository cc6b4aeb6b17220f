//! Writing of a dataset: the shards and entry of each video, and the common files.

pub mod assemble;
pub mod entry;
pub mod tar;
