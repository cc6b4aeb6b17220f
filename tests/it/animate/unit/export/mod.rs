//! Tests of single modules of `orator_avatar::animate::export`.

mod fbx_curves;
mod film_file;
mod film_source;
