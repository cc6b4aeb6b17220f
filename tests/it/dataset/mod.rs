//! The dataset: written, read, verified, imported, forgotten.

pub mod dataset;
pub mod dataset_verify;
pub mod forget;
pub mod import;
pub mod import_readers;
pub mod people;
pub mod posture;
pub mod shard;
pub mod shared_sound;
pub mod sound_offset;
pub mod splits;
pub mod splits_by_time;
pub mod words;
