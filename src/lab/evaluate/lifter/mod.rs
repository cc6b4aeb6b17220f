//! Errors of the lifters on captured motion seen by random cameras: bodies and hands.

pub mod bodies;
pub mod hands;
