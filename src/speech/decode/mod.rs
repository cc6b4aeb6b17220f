//! Decoding of one window of sound to tokens, with the rules, the searches and the fallbacks of Whisper (Radford et al.
//! 2022, section 4.5).

pub(crate) mod language;
pub(crate) mod rules;
pub(crate) mod search;
pub(crate) mod window;
