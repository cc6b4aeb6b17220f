//! Keypoints that other programs found, the kind told by the content: OpenPose, MMPose, COCO-WholeBody and AlphaPose as
//! JSON (`folder` a file a frame, `document` a file a video, `entry` a person in it, `numbers` its lists), MediaPipe,
//! PATS and our own as arrays (`arrays`, `mediapipe`, `pats`). `layout` has the orders of joints, `range` tells their unit, `found` what all
//! become, `frames` puts numbered frames in order, `read` chooses.

pub mod arrays;
pub mod document;
pub mod entry;
pub mod folder;
pub mod found;
pub mod frames;
pub mod layout;
pub mod mediapipe;
pub mod numbers;
pub mod pats;
pub mod range;
pub mod read;

pub use found::{CoordinateUnit, FoundKeypoints, FoundPerson};
pub use read::read;
