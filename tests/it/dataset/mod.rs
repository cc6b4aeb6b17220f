//! The dataset: written, read, verified, imported, forgotten.

pub(crate) mod dataset;
pub(crate) mod dataset_verify;
pub(crate) mod forget;
pub(crate) mod import;
pub(crate) mod import_readers;
pub(crate) mod people;
pub(crate) mod posture;
pub(crate) mod shard;
pub(crate) mod shared_sound;
pub(crate) mod sound_offset;
pub(crate) mod splits;
pub(crate) mod splits_by_time;
pub(crate) mod words;
