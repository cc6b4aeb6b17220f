//! Report on the videos of speakers. Data (`gather`, one pass over the videos): `video`, `what_if`,
//! `distributions`, `movement`, `worst`, `pictures`. Sections: `summary`, `timelines`, `gallery`, `distributions`,
//! `sliders`, `motion`; `page` combines them.

pub mod distributions;
pub mod gallery;
pub mod gather;
pub mod motion;
pub mod movement;
pub mod page;
pub mod pictures;
pub mod reasons;
pub mod sliders;
pub mod summary;
pub mod thresholds;
pub mod timelines;
pub mod video;
pub mod what_if;
pub mod worst;
