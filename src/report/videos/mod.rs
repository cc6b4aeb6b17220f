//! Report on the videos of speakers. `gather` collects the data in one pass over the videos; the sections are
//! `summary`, `timelines`, `worst`, `distributions`, `sliders` and `movement`; `page` combines them.

pub mod distributions;
pub mod gather;
pub mod movement;
pub mod page;
pub mod sliders;
pub mod summary;
pub mod thresholds;
pub mod timelines;
pub mod worst;
