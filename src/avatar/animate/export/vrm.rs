//! VRM 1.0: the avatar as a humanoid (`.vrm`, extension `VRMC_vrm`) and its motion (`.vrma`, `VRMC_vrm_animation`).
//! Both are glTF with further rules: T-pose at rest without rotations, metres, y up, facing +z.

use super::glb::GlbBuffer;
use super::glb_scene;
use crate::animate::avatar::Avatar;
use crate::animate::rig::file_skeleton::{FileSkeleton, RestAxes};
use crate::animate::rig::names::Names;
use crate::animate::rig::rig::Rig;
use orator_base::motion::fk::Skeleton;
use orator_formats::bvh::write::BvhClip;
use serde_json::{Map, Value, json};

/// Licence URL that the format requires.
const LICENSE: &str = "https://vrm.dev/licenses/1.0/";

/// Bytes of the `.vrm` file of an avatar on its rig, without motion.
pub fn avatar(rig: &Rig, avatar: &Avatar) -> Vec<u8> {
    let skeleton = FileSkeleton::new(&rig.skeleton, Names::Vrm, RestAxes::Convention);
    let mut buffer = GlbBuffer::default();
    let mut scene = glb_scene::scene(&mut buffer, &skeleton, rig.root, avatar);
    make_humanoid(&mut scene, &skeleton.skeleton);
    buffer.file(scene)
}

/// Bytes of the `.vrma` file of a clip: joints without skin, the animation, the mapping of humanoid bones to nodes.
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
    let extension = json!({ "specVersion": "1.0", "humanoid": { "humanBones": bones(&skeleton.skeleton) } });
    scene["extensionsUsed"] = json!(["VRMC_vrm_animation"]);
    scene["extensions"] = json!({ "VRMC_vrm_animation": extension });
    buffer.file(scene)
}

/// Turns a scene with VRM names into a humanoid: adds bones, open-mouth expression, author and permissions.
pub fn make_humanoid(scene: &mut Value, named: &Skeleton) {
    // The last node is the face.
    let face = named.joints.len() + 1;
    let extension = json!({
        "specVersion": "1.0",
        "meta": {
            "name": "Avatar",
            "version": env!("CARGO_PKG_VERSION"),
            "authors": ["orator"],
            "copyrightInformation": "made by a program; free for any use",
            "licenseUrl": LICENSE,
            "avatarPermission": "everyone",
            "allowExcessivelyViolentUsage": true,
            "allowExcessivelySexualUsage": true,
            "commercialUsage": "corporation",
            "allowPoliticalOrReligiousUsage": true,
            "allowAntisocialOrHateUsage": false,
            "creditNotation": "unnecessary",
            "allowRedistribution": true,
            "modification": "allowModificationRedistribution",
        },
        "humanoid": { "humanBones": bones(named) },
        "expressions": {
            "preset": { "aa": { "morphTargetBinds": [{ "node": face, "index": 0, "weight": 1.0 }] } },
        },
    });
    scene["extensionsUsed"] = json!(["VRMC_vrm"]);
    scene["extensions"] = json!({ "VRMC_vrm": extension });
}

fn bones(named: &Skeleton) -> Map<String, Value> {
    let moving = named.joints.iter().enumerate().filter(|(_, joint)| !joint.end);
    moving.map(|(node, joint)| (joint.name.clone(), json!({ "node": node }))).collect()
}
