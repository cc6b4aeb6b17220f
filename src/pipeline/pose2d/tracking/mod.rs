//! The one speaker among the people of a video: `person` asks the detector, `tracker` chooses and follows, `liveness`
//! tells a person from a picture of one, `appearance` one person from another (both on a `patch` of the picture);
//! `speaker` puts them together.

pub mod appearance;
pub mod liveness;
pub mod patch;
pub mod person;
pub mod speaker;
pub mod tracker;
