//! Verbs for many machines on one work folder: `plan`, `work`, `submit`, and `status --plan`.

pub(super) mod plan;
pub(super) mod submit;
pub(super) mod work;
