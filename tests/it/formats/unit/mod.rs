//! Tests of single modules of `orator-formats`.

mod bvh;
mod checkpoint;
mod glove;
mod joint_names;
mod joints_npz;
mod mocap;
mod skeleton;
mod sound_offset_json;
mod ted;
mod textgrid;
mod tfevents;
mod timeline_npz;
mod transcript;
mod word_vectors;
