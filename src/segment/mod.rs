//! Stage 3: keypoints to intervals worth keeping. `measure` turns keypoints into a few numbers a frame, `rules` judges
//! them into stretches kept and refused, `refusal` says why in words, `stage` reads and writes the files.

pub mod measure;
pub mod refusal;
pub mod rules;
mod stage;

pub use refusal::Refusal;
pub use stage::SegmentStage;
