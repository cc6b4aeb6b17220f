//! Many machines on one work folder: `plan`, `work`, `submit`, and `status --plan`.

pub mod plan;
pub mod submit;
pub mod work;
