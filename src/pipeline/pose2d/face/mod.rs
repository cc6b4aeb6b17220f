//! Face of the followed person: `model` predicts 468 points in a square of the picture, `landmarks` measures the mouth
//! opening and the next region, `tracker` follows the face between frames, `views` builds the portrait.

pub mod landmarks;
pub mod model;
pub mod tracker;
pub mod views;

pub use tracker::FaceTrack;
