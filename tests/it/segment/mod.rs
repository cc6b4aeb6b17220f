//! What is kept and what is refused.

pub mod redecide;
pub mod rendered_voices;
pub mod segment;
pub mod speech;
pub mod voices;
