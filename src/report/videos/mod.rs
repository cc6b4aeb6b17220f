//! Report on the videos of speakers. `gather` collects the data in one pass over the videos; the sections are
//! `summary`, `timelines`, `worst`, `distributions`, `sliders`, `movement` and `gestures`; `page` combines them.

pub mod distributions;
pub mod gather;
pub mod gestures;
pub mod movement;
pub mod page;
pub mod sliders;
pub mod summary;
pub mod thresholds;
pub mod timelines;
pub mod worst;
