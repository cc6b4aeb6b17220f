//! Writing of a dataset: shards and entry of a video, and the common files.

pub mod assemble;
pub mod part;
pub mod tar;
