//! VRM 1.0: the avatar as a humanoid (`.vrm`, extension `VRMC_vrm`) and its motion (`.vrma`, `VRMC_vrm_animation`), both
//! glTF under further rules: T-pose at rest, metres, y up, facing +z, no rotations at rest here.

use super::glb::GlbBuffer;
use super::{glb_scene, vrm_humanoid};
use crate::animate::avatar::Avatar;
use crate::animate::rig::file_skeleton::{FileSkeleton, RestAxes};
use crate::animate::rig::names::Names;
use crate::animate::rig::rig::Rig;
use orator_formats::bvh::write::BvhClip;
use serde_json::json;

/// Bytes of the `.vrm` file of the avatar on its rig, without motion.
pub fn avatar(rig: &Rig, avatar: &Avatar) -> Vec<u8> {
    let skeleton = FileSkeleton::new(&rig.skeleton, Names::Vrm, RestAxes::Convention);
    let mut buffer = GlbBuffer::default();
    let mut scene = glb_scene::scene(&mut buffer, &skeleton, rig.root, avatar);
    vrm_humanoid::make(&mut scene, &skeleton.skeleton);
    buffer.file(scene)
}

/// Bytes of the `.vrma` file of a clip: the joints without a skin, the animation, and which joint is which bone.
pub fn motion(rig: &Rig, clip: &BvhClip) -> Vec<u8> {
    let skeleton = FileSkeleton::new(&rig.skeleton, Names::Vrm, RestAxes::Convention);
    let mut buffer = GlbBuffer::default();
    let mut scene = json!({
        "asset": glb_scene::asset(),
        "scene": 0,
        "scenes": [{ "name": "Figure", "nodes": [0] }],
        "nodes": glb_scene::joint_nodes(&skeleton, clip.root),
    });
    if clip.n_frames() > 0 {
        scene["animations"] = json!([glb_scene::animation(&mut buffer, &skeleton.clip(clip))]);
    }
    let extension =
        json!({ "specVersion": "1.0", "humanoid": { "humanBones": vrm_humanoid::bones(&skeleton.skeleton) } });
    scene["extensionsUsed"] = json!(["VRMC_vrm_animation"]);
    scene["extensions"] = json!({ "VRMC_vrm_animation": extension });
    buffer.file(scene)
}
