//! The synthetic speaker: a drawn figure that talks with its hands, whose every joint is known in 3D. It is the
//! embedded demo and the end-to-end test of the road: a video of it goes in at the front, and what comes out at the
//! back is held against the truth. Nothing here knows a stage; `measure` reads their files.
//!
//! `speech` decides when syllables fall and sounds them -> `gesture` moves the body to them -> `figure` turns the
//! body's controls into joints -> `camera` sees them -> `paint` draws them, one colour a joint (`palette`).
//!
//! Without a picture: `speech` -> `rule` (a known rule, instead of `gesture`) -> `figure` -> `speaker` (hours of it, as a
//! dataset) -> `train::gan` -> `learned`, which holds a trained speaker against the rule and against `listener`
//! (`traces` draws it).

pub mod check;
pub mod drawn;
pub mod rule;

pub use drawn::generator_version::GENERATOR;
