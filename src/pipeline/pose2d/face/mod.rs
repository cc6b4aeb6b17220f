//! The face of the person followed: `model` finds 468 points in a square of the picture, `landmarks` says how far the
//! mouth is open and where the face will be next, `tracker` follows it from frame to frame, `views` sums up whose
//! face it is.

pub mod landmarks;
pub mod model;
pub mod tracker;
pub mod views;

pub use tracker::FaceTrack;
