//! Tests of single modules of `orator_base::motion`.

mod bones;
mod hand_bones;
mod view_body;
