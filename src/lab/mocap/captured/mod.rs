//! Captured motion that drives rendered persons: `take` (frames and excerpts),
//! `readers` (one for each kind of file), `source` (the named sources and their files), `split` (the part of a
//! set to which each take belongs).

pub mod readers;
pub mod source;
pub mod split;
pub mod take;
