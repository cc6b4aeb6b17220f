//! Binary FBX 7.4: the container, and a performance in it.

pub mod binary;
pub mod curves;
pub mod document;
pub mod mesh;
pub mod scene;
