//! Humanoid of VRM 1.0 (`VRMC_vrm`): which node of a scene is which bone, the avatar's author and licence.

use orator_base::motion::fk::Skeleton;
use serde_json::{Map, Value, json};

/// Licence address that the format requires.
const LICENSE: &str = "https://vrm.dev/licenses/1.0/";

/// Makes a scene of VRM's names a humanoid: its bones, the open mouth of the face, the avatar's author and what the licence
/// allows: everything.
pub fn make(scene: &mut Value, named: &Skeleton) {
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

/// Node of every bone of the humanoid.
pub fn bones(named: &Skeleton) -> Map<String, Value> {
    let moving = named.joints.iter().enumerate().filter(|(_, joint)| !joint.end);
    moving.map(|(node, joint)| (joint.name.clone(), json!({ "node": node }))).collect()
}
