//! Drawn speaker: speech, gesture, figure, camera, paint.

pub mod camera;
pub mod figure;
pub mod folder;
pub mod gesture;
pub mod paint;
pub mod palette;
pub mod scene;
pub mod speech;
pub mod truth;
