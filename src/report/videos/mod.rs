//! The page of a speaker's videos. Gathered (`gather`, once through the videos): `video`, `what_if`, `spread`,
//! `movement`, `worst`, `pictures`. Shown: `summary`, `timelines`, `gallery`, `distributions`, `sliders`, `motion`;
//! `page` puts them together.

pub mod distributions;
pub mod gallery;
pub mod gather;
pub mod motion;
pub mod movement;
pub mod page;
pub mod pictures;
pub mod reasons;
pub mod sliders;
pub mod spread;
pub mod summary;
pub mod thresholds;
pub mod timelines;
pub mod video;
pub mod what_if;
pub mod worst;
