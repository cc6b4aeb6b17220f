//! The dataset: written, read, verified, imported, forgotten.

pub(crate) mod audio_offset;
pub(crate) mod dataset;
pub(crate) mod dataset_verify;
pub(crate) mod decisions;
pub(crate) mod forget;
mod genea_folders;
pub(crate) mod import;
pub(crate) mod import_readers;
pub(crate) mod posture;
pub(crate) mod several_persons;
pub(crate) mod shard;
pub(crate) mod shared_audio;
mod split;
pub(crate) mod splits;
pub(crate) mod splits_by_time;
pub(crate) mod transcribe;
pub(crate) mod transcripts;
mod unit;
pub(crate) mod words;
