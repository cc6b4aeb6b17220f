//! What is kept and what is refused.

pub(crate) mod redecide;
pub(crate) mod rendered_voices;
pub(crate) mod segment;
pub(crate) mod speech;
pub(crate) mod voices;
