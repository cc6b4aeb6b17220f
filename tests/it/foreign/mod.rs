//! Our files opened by programs that others wrote.

pub mod aligned_words;
pub mod blender;
pub mod dataset_readers;
pub mod label_readers;
pub mod training_readers;
