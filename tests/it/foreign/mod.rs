//! Output files read by external programs, transcripts written by them, and their skeletons.

pub(crate) mod aligned_text;
pub(crate) mod aligned_words;
pub(crate) mod blender;
pub(crate) mod dataset_readers;
pub(crate) mod elan;
pub(crate) mod fbx;
pub(crate) mod joint_structure;
pub(crate) mod onnx;
pub(crate) mod read_speech;
pub(crate) mod recognised_words;
pub(crate) mod retargeted;
pub(crate) mod training_readers;
pub(crate) mod transcripts;
pub(crate) mod vrm;
