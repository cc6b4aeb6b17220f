//! Tests of single modules of `orator-formats`.

mod glove;
mod skeleton;
mod textgrid;
