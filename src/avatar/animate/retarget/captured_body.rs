//! Head, trunk and legs of a captured skeleton (BVH, SMPL-X) on our rig. Bones of trunk, neck and legs take the
//! captured directions and roll with their joints; hips, head and feet take the rotations of their joints relative to the
//! reference pose. Legs have the captured lengths, and the arms keep their world rotations.

use super::bone_map::BoneMap;
use super::bvh_rig::BvhRig;
use super::transfer::ReferencePose;
use super::user_rig::UserRig;
use crate::animate::rig::rig::{CM, Rig};
use crate::animate::solve::track::RotationTrack;
use anyhow::Result;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, norm, scale, sub, unit};
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::bvh::write::BvhClip;
use orator_formats::mocap;
use orator_formats::mocap::facing::LengthUnit;
use orator_formats::mocap::motion_file::{DEFAULT_FPS, has_skeleton};
use orator_formats::mocap::smplx::motion::SmplxMotion;
use serde::Serialize;
use std::ops::Range;
use std::path::Path;

/// Minimum length of a bone whose direction is defined, cm.
const MIN_CM: f64 = 1e-3;
/// Maximum coordinate of the hips, cm.
const MAX_CM: f64 = 1e6;
/// Accepted ratios of a captured offset in a leg to the rig's own, which is proportional to the arms.
const LEG_RATIOS: Range<f64> = 0.4..2.5;
const UP: Vec3 = [0.0, 1.0, 0.0];
const DOWN: Vec3 = [0.0, -1.0, 0.0];
/// Clavicles of the rig, with the ends of these bones and their directions at rest.
const CLAVICLES: [(&str, &str, Vec3); 2] =
    [("LeftShoulder", "LeftArm", [1.0, 0.0, 0.0]), ("RightShoulder", "RightArm", [-1.0, 0.0, 0.0])];
const LEGS: [[&str; 3]; 2] = [["LeftUpLeg", "LeftLeg", "LeftFoot"], ["RightUpLeg", "RightLeg", "RightFoot"]];

/// Part of the body that a capture may contain in addition to the arms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CapturedPart {
    /// Head and neck.
    Head,
    /// Hips, spine and chest.
    Spine,
    /// Both legs, and the translation of the hips.
    Legs,
}

impl CapturedPart {
    const ALL: [Self; 3] = [Self::Head, Self::Spine, Self::Legs];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Spine => "spine",
            Self::Legs => "legs",
        }
    }
}

/// Captured head, trunk and legs in the axes of the rig (y up, facing +z). The trunk is always present.
#[derive(Clone, Debug)]
pub struct CapturedBody {
    bones: Vec<(CapturedBone, RotationTrack)>,
    /// Rotations of bones of the rig in the rest pose of the capture.
    rest: Vec<(&'static str, Rotation)>,
    /// Position of the hips by frame, cm.
    hips: Vec<Vec3>,
    /// Left, right: rest offsets of upper leg, lower leg, foot and end of the foot from their parents, cm.
    legs: Option<[[Option<Vec3>; 4]; 2]>,
}

/// Bone of the rig that a captured joint moves.
#[derive(Clone, Copy, Debug)]
struct CapturedBone {
    part: CapturedPart,
    ours: &'static str,
    joint: usize,
    /// Joint to which the bone points, and its direction at rest; `None` to use the rotation of the joint alone.
    to: Option<(usize, Vec3)>,
}

impl CapturedBody {
    /// Reads the body of a BVH or SMPL-X file; `None` for others, and if hips, trunk or arms are not found by name, a
    /// joint does not have three rotation channels, or a value is not finite. Without `units`, the unit is detected.
    ///
    /// # Errors
    /// The file is unreadable or not of its kind.
    pub fn read(path: &Path, units: Option<LengthUnit>) -> Result<Option<Self>> {
        if !has_skeleton(path)? {
            return Ok(None);
        }
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("bvh")) {
            return Ok(Self::from_bvh(&Bvh::read(path)?, units));
        }
        // The frame rate does not matter here.
        let mut motion = SmplxMotion::read(path, Some(DEFAULT_FPS))?;
        motion.hold_missing();
        Ok(Self::from_bvh(&motion.bvh(), Some(LengthUnit::METRE)))
    }

    fn from_bvh(bvh: &Bvh, units: Option<LengthUnit>) -> Option<Self> {
        let file = BvhRig::new(bvh).ok()?;
        let user = file.rig();
        let map = BoneMap::detect(&user).ok()?;
        let reference = ReferencePose::of(&user, &map).ok()?;
        let bones = captured_bones(&map)?;
        let rest = if reference.is_rest_pose { rest_rotations(&reference, &map, &bones) } else { Vec::new() };
        let positions = bvh.positions(Positions::Auto);
        let alignment = mocap::bvh::unrotated_alignment(bvh, &positions, units).ok()?;
        let (axes, cm) = (alignment.rotation(), alignment.metres * CM);
        let bone_at =
            |t: usize, from: usize, to: usize| axes.turn(scale(sub(positions[t][to], positions[t][from]), cm));
        let mut tracks = vec![RotationTrack::new(); bones.len()];
        for (t, frame) in bvh.frames().enumerate() {
            let local = file.local(frame);
            let placed = user.placed(|joint, parent| parent * local[joint]);
            for (bone, track) in bones.iter().zip(&mut tracks) {
                let since_reference = placed[bone.joint].turn * reference.joints[bone.joint].turn.inverse();
                let turned = axes * since_reference * reference.axes;
                let swing = bone.to.and_then(|(to, rest)| {
                    Some(Rotation::between(turned.turn(rest), unit(bone_at(t, bone.joint, to), MIN_CM)?))
                });
                track.push(swing.map_or(turned, |swing| swing * turned));
            }
        }
        let is_finite = tracks.iter().flatten().all(|turn| turn.w.is_finite() && turn.v.iter().all(|v| v.is_finite()));
        let root = map.joint("Hips")?;
        let hips: Vec<Vec3> = positions.iter().map(|frame| axes.turn(scale(frame[root], cm))).collect();
        if !is_finite || !hips.iter().flatten().all(|v| v.abs() < MAX_CM) {
            return None;
        }
        let bones: Vec<(CapturedBone, RotationTrack)> = bones.into_iter().zip(tracks).collect();
        let first = |ours: &str| {
            let (bone, track) = bones.iter().find(|(bone, _)| bone.ours == ours)?;
            Some((bone.joint, track.first()?.inverse()))
        };
        let leg = |[upper, lower, foot]: [&str; 3]| {
            let (hips, from_hips) = first("Hips")?;
            let ((upper, _), (lower, _), (foot, from_foot)) = (first(upper)?, first(lower)?, first(foot)?);
            let down = |from: usize, to: usize| scale(DOWN, norm(bone_at(0, from, to)));
            let toe = first_child(&user, foot).map(|toe| from_foot.turn(bone_at(0, foot, toe)));
            Some([
                Some(from_hips.turn(bone_at(0, hips, upper))),
                Some(down(upper, lower)),
                Some(down(lower, foot)),
                toe,
            ])
        };
        let [left, right] = LEGS.map(leg);
        Some(Self { hips, legs: left.zip(right).map(|(left, right)| [left, right]), bones, rest })
    }

    /// The body without a part, which then moves as without a capture.
    pub fn without(mut self, part: CapturedPart) -> Self {
        self.bones.retain(|(bone, _)| bone.part != part);
        self.rest.retain(|(ours, _)| part != CapturedPart::Head || *ours != "Neck");
        self
    }

    pub fn parts(&self) -> Vec<CapturedPart> {
        let has = |part: &CapturedPart| self.bones.iter().any(|(bone, _)| bone.part == *part);
        CapturedPart::ALL.into_iter().filter(has).collect()
    }

    /// Gives a rig the rest pose of the capture, and its legs the captured lengths unless implausible for its arms.
    pub fn fit(&self, rig: &mut Rig) {
        let rest = self.rest.iter().filter_map(|(ours, turn)| Some((rig.skeleton.find(ours)?, *turn))).collect();
        rig.rest = rest;
        let Some(legs) = self.legs.filter(|_| self.parts().contains(&CapturedPart::Legs)) else { return };
        let joints = rig.legs;
        let is_plausible = |(&joint, offset): (&usize, &Option<Vec3>)| {
            offset.is_none_or(|offset| LEG_RATIOS.contains(&(norm(offset) / norm(rig.skeleton.joints[joint].offset))))
        };
        if !joints.iter().flatten().zip(legs.iter().flatten()).all(is_plausible) {
            return;
        }
        rig.root[1] = 0.0;
        for (joints, offsets) in joints.into_iter().zip(legs) {
            // The sole of the avatar is at the rig's own height below the ankle.
            let mut height = -rig.skeleton.joints[joints[3]].offset[1];
            for (joint, offset) in joints.into_iter().zip(offsets) {
                if let Some(offset) = offset {
                    rig.skeleton.joints[joint].offset = offset;
                }
                height -= if joint == joints[3] { 0.0 } else { rig.skeleton.joints[joint].offset[1] };
            }
            rig.root[1] = rig.root[1].max(height);
        }
    }

    /// Turns trunk, head and legs of a clip of the motion that was read from the same file, and moves its hips.
    pub fn apply(&self, rig: &Rig, clip: &mut BvhClip) {
        let mut tracks: Vec<Option<&RotationTrack>> = vec![None; rig.skeleton.joints.len()];
        for (bone, track) in &self.bones {
            if let Some(joint) = rig.skeleton.find(bone.ours) {
                tracks[joint] = Some(track);
            }
        }
        for (t, local) in clip.local.iter_mut().enumerate() {
            let chest = local[0] * local[rig.spine] * local[rig.chest];
            let mut world: Vec<Rotation> = Vec::with_capacity(local.len());
            for (n, joint) in rig.skeleton.joints.iter().enumerate() {
                let parent = joint.parent.map_or(Rotation::IDENTITY, |parent| world[parent]);
                if let Some(&captured) = tracks[n].and_then(|track| track.get(t)) {
                    local[n] = parent.inverse() * captured;
                } else if joint.parent == Some(rig.chest) {
                    // Arms, and a neck that was not captured, keep their world rotations.
                    local[n] = parent.inverse() * chest * local[n];
                }
                world.push(parent * local[n]);
            }
        }
        if self.parts().contains(&CapturedPart::Legs) {
            clip.travel = self.hips.iter().map(|&hips| sub(hips, clip.root)).collect();
        }
    }
}

/// Bones of ours that the mapped joints move; `None` without a trunk.
fn captured_bones(map: &BoneMap) -> Option<Vec<CapturedBone>> {
    let bone = |part, ours, joint, to| CapturedBone { part, ours, joint, to };
    let (hips, neck) = (map.joint("Hips")?, map.joint("Neck"));
    let spine = map.joint("Spine").or(map.joint("Chest"))?;
    let chest = map.joint("Chest").unwrap_or(spine);
    let above = if spine == chest { neck } else { Some(chest) };
    // Without a neck, the bone below it takes the rotation of its joint alone.
    let up_to = |joint: Option<usize>| joint.map(|joint| (joint, UP));
    let mut bones = vec![
        bone(CapturedPart::Spine, "Hips", hips, None),
        bone(CapturedPart::Spine, "Spine", spine, up_to(above)),
        bone(CapturedPart::Spine, "Chest", chest, up_to(neck)),
    ];
    if let Some(head) = map.joint("Head") {
        if let Some(neck) = neck {
            bones.push(bone(CapturedPart::Head, "Neck", neck, up_to(Some(head))));
        }
        bones.push(bone(CapturedPart::Head, "Head", head, None));
    }
    let leg = |names: [&'static str; 3]| {
        let [upper, lower, foot] = names.map(|name| map.joint(name));
        Some([(names[0], upper?, lower), (names[1], lower?, foot), (names[2], foot?, None)])
    };
    if let [Some(left), Some(right)] = LEGS.map(leg) {
        let legs = left.into_iter().chain(right);
        bones.extend(legs.map(|(ours, joint, to)| bone(CapturedPart::Legs, ours, joint, to.map(|to| (to, DOWN)))));
    }
    Some(bones)
}

/// Rotations of the rig's trunk, neck and clavicles in the rest pose of a capture. The clavicles of the rig start at
/// the neck, or at the middle of the shoulders.
fn rest_rotations(reference: &ReferencePose, map: &BoneMap, bones: &[CapturedBone]) -> Vec<(&'static str, Rotation)> {
    let position = |joint: usize| reference.joints[joint].position;
    let turn = |ours: &'static str, rest: Vec3, from: usize, to: usize| {
        let direction = unit(reference.axes.inverse().turn(sub(position(to), position(from))), 1e-9)?;
        Some((ours, Rotation::between(rest, direction)))
    };
    let trunk = bones.iter().filter(|bone| bone.part != CapturedPart::Legs);
    let trunk = trunk.filter_map(|bone| turn(bone.ours, UP, bone.joint, bone.to?.0));
    let clavicles = CLAVICLES.into_iter().filter_map(|(ours, arm, rest)| match map.joint("Neck") {
        Some(neck) => turn(ours, rest, neck, map.joint(arm)?),
        None => Some((ours, Rotation::IDENTITY)),
    });
    trunk.chain(clavicles).collect()
}

/// The first child of a joint that does not coincide with it.
fn first_child(user: &UserRig, joint: usize) -> Option<usize> {
    user.joints.iter().position(|child| child.parent == Some(joint) && norm(child.offset) > 0.0)
}
