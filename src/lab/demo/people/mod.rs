//! Rendered persons: videos with sound of a gesturing person in a room, and the exact ground truth of every frame.
//!
//! `condition` (the tested aspect) -> `body`, `voice`, `motion` with `vocabulary` (the movements), `contact`, `trunk`
//! (the rig's rotations) -> `actor`, `held`, `solid`, `set`, `view` -> `scene` with `lens` and `truth` -> `folder`.

pub mod actor;
pub mod body;
pub mod condition;
pub mod contact;
pub mod folder;
pub mod held;
pub mod lens;
pub mod motion;
pub mod scene;
pub mod set;
pub mod solid;
pub mod trunk;
pub mod truth;
pub mod view;
pub mod vocabulary;
pub mod voice;
