//! Tests of single modules of `orator-formats`.

mod checkpoint;
mod glove;
mod joints_npz;
mod skeleton;
mod sound_offset_json;
mod ted;
mod textgrid;
mod timeline_npz;
