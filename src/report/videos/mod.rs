//! Page of a speaker's videos. Data (`gather`, one pass over the videos): `video`, `what_if`, `spread`, `motion`, `worst`,
//! `pictures`. Sections: `summary`, `timelines`, `pictures`, `spread`, `sliders`, `motion`; `page` joins them.

pub mod gather;
pub mod motion;
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
