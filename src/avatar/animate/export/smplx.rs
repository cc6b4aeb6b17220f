//! SMPL-X rotations of a rig, whose joints at rest have the axes of SMPL-X: bones with the same name, and its chest. The
//! other joints (jaw, eyes, toes and the middle of the spine) do not turn, and keep their offsets of the rest pose.

use crate::animate::performance::Performance;
use crate::animate::rig::rig::CM;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale, sub};
use orator_formats::mocap::smplx::body::{self, CHEST, N_POINTS, N_SMPLX};
use orator_formats::mocap::smplx::motion::SmplxMotion;

/// The motion with the proportions of the rig.
pub fn motion(performance: &Performance) -> SmplxMotion {
    let Performance { rig, clip, .. } = performance;
    let joint = |joint: usize| if joint == CHEST { Some(rig.chest) } else { rig.skeleton.find(&body::name(joint)) };
    let joints: [Option<usize>; N_SMPLX] = std::array::from_fn(joint);
    let tip = |point: usize| rig.skeleton.children(joints[body::parent(point)?]?).next();
    let at_rest = rig.skeleton.positions([0.0; 3], &vec![Rotation::IDENTITY; rig.skeleton.joints.len()]);
    let standard = body::rest();
    let mut rest = standard;
    for point in 1..N_POINTS {
        let ours = joints.get(point).copied().unwrap_or_else(|| tip(point));
        let beside_parent = || {
            let parent = body::parent(point).unwrap_or_default();
            add(rest[parent], sub(standard[point], standard[parent]))
        };
        rest[point] = ours.map_or_else(beside_parent, |ours| add(standard[0], metres(at_rest[ours])));
    }
    let rotation = |local: &[Rotation], ours: Option<usize>| ours.map_or(Rotation::IDENTITY, |ours| local[ours]);
    let translation = (0..clip.n_frames()).map(|frame| sub(metres(clip.root_at(frame)), rest[0]));
    SmplxMotion {
        fps: clip.fps,
        rest,
        translation: Some(translation.collect()),
        rotations: clip.local.iter().map(|local| joints.map(|ours| rotation(local, ours))).collect(),
    }
}

fn metres(cm: Vec3) -> Vec3 {
    scale(cm, 1.0 / CM)
}
