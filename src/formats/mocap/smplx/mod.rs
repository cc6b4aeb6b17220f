//! SMPL-X and SMPL-H (Pavlakos et al. 2019, Romero et al. 2017) without the files of the body models: `body` is the
//! skeleton, `motion` the `.npz` files of rotations.

pub mod body;
pub mod motion;
