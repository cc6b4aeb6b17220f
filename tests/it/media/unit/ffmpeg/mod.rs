//! Tests of single modules of `orator_media::ffmpeg`.

mod orientation;
