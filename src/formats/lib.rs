//! Readers and writers of file formats. Every read error names the file, the position in it and what was expected.

pub mod authors_txt;
pub mod bvh;
pub mod checkpoint;
pub mod eaf;
pub mod joints_description;
pub mod joints_npz;
pub mod keypoints;
pub mod keypoints_npz;
pub mod media_json;
pub mod mocap;
pub mod npy;
pub mod npz;
pub mod search;
pub mod skeleton;
pub mod sound_offset_json;
pub mod tfevents;
pub mod timeline_npz;
pub mod transcript;
pub mod wav;
pub mod word_vectors;
