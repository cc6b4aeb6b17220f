//! Captured motion that drives rendered persons: `take` (frames and excerpts), `smplx_body` (forward kinematics of
//! SMPL-X), `readers` (one for each kind of file), `source` (the named sources and their files), `split` (the part of a
//! set to which each take belongs).

pub mod readers;
pub mod smplx_body;
pub mod source;
pub mod split;
pub mod take;
