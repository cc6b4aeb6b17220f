//! Keypoints that other programs found, the kind derived from the content: OpenPose, MMPose, COCO-WholeBody and AlphaPose
//! as JSON (`document`, `entry` a person in it), MediaPipe, PATS and our own as arrays (`arrays`, `mediapipe`, `pats`).
//! `layout` has the orders of joints, `range` derives their unit, `found` is what all become, `frames` puts numbered frames
//! in order, `read` chooses.

pub mod arrays;
pub mod document;
pub mod entry;
pub mod found;
pub mod frames;
pub mod layout;
pub mod mediapipe;
pub mod pats;
pub mod range;
pub mod read;

pub use found::{CoordinateUnit, FoundKeypoints, FoundPerson};
pub use read::read;
