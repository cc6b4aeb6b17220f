//! Output files read by external programs, and transcripts written by them.

pub(crate) mod aligned_words;
pub(crate) mod blender;
pub(crate) mod dataset_readers;
pub(crate) mod fbx;
pub(crate) mod retargeted;
pub(crate) mod training_readers;
pub(crate) mod transcripts;
pub(crate) mod vrm;
