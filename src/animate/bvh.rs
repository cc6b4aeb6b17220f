//! Motion as a BVH file of the whole figure: cm, y up, facing +z, T-pose at rest, the frame rate of the motion.

use super::{figure::Figure, rotations::rotations};
use crate::motion::bvh_write::Clip;
use crate::types::pose3d::Motion;

/// The motion on its figure.
pub fn clip(motion: &Motion) -> Clip {
    let figure = Figure::of(motion);
    let local = rotations(motion, &figure);
    Clip { root: figure.root, skeleton: figure.skeleton, fps: motion.fps, local }
}

/// The text of the BVH file.
pub fn text(motion: &Motion) -> String {
    clip(motion).to_bvh()
}
