//! Tests of single modules of `orator_avatar::animate::retarget`.

mod bone_map;
mod glb_rig;
