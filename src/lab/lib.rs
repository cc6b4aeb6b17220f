//! Tools for developing and validating orator itself: synthetic speakers (`demo`), training of the body and hand
//! lifters that the program ships (`train`), their evaluation on rendered persons (`evaluate`), the motion-capture
//! readers used by both (`mocap`, `rendered_truth`), and the guide as a site (`docs`). No other crate depends on this
//! one; its binary is `orator-lab`.

pub mod cli;
pub mod demo;
pub mod docs;
pub mod evaluate;
pub mod mocap;
pub mod rendered_truth;
pub mod train;
