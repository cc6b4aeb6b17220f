//! Keypoints detected by other programs, with the format derived from the content: JSON of OpenPose, MMPose,
//! COCO-WholeBody and AlphaPose (`document`; `entry` is one person), and arrays of MediaPipe, PATS, COCO and this program
//! (`arrays`, `mediapipe`, `pats`, `counted`). `read` selects the reader, `layout` holds the point orders, `plausible`
//! checks them, `range` derives the unit, `frames` orders numbered frames, and `found` is the common result.

pub mod arrays;
pub mod counted;
pub mod document;
pub mod entry;
pub mod found;
pub mod frames;
pub mod layout;
pub mod mediapipe;
pub mod pats;
pub mod plausible;
pub mod range;
pub mod read;

pub use found::{CoordinateUnit, FoundKeypoints, FoundPerson};
pub use read::read;
