//! Our files opened by programs that others wrote.

pub mod aligned_words;
pub mod blender;
pub mod dataset_readers;
pub mod fbx;
pub mod retargeted;
pub mod training_readers;
pub mod vrm;
