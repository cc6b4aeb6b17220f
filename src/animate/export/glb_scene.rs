//! Performance as a glTF scene: the rig's joints as nodes in T-pose (metres, y up, facing +z), the avatar as
//! skinned meshes, the clip as one animation. Joints that do not turn have one key.

use super::glb::{BufferUse, GlbBuffer};
use crate::animate::avatar::{Avatar, AvatarMesh};
use crate::animate::rig::names::Names;
use crate::animate::rig::rig::Rig;
use crate::formats::bvh::write::BvhClip;
use crate::math::rotation::Rotation;
use crate::math::vec3::Vec3;
use serde_json::{Value, json};

const METRES: f64 = 0.01;
/// Largest difference of the quaternions of a joint that does not turn.
const STILL: f64 = 1e-7;
/// Licence address that the VRM format requires.
const VRM_LICENSE: &str = "https://vrm.dev/licenses/1.0/";

/// Bytes of the GLB file of a clip on its rig with `avatar` as its skin.
pub fn file(rig: &Rig, clip: &BvhClip, avatar: &Avatar, names: Names) -> Vec<u8> {
    let mut buffer = GlbBuffer::default();
    let bones = &rig.skeleton.joints;
    let own = Names::Own.of(&rig.skeleton);
    let called = names.of(&rig.skeleton);
    let mut nodes: Vec<Value> = bones
        .iter()
        .zip(&called)
        .enumerate()
        .map(|(joint, (bone, name))| {
            let at = bone.parent.map_or(clip.root, |_| bone.offset);
            let mut node = json!({ "name": name, "translation": metres(at) });
            let children: Vec<usize> = rig.skeleton.children(joint).collect();
            if !children.is_empty() {
                node["children"] = json!(children);
            }
            node
        })
        .collect();
    // The face is a mesh of its own, since all parts of a mesh have the same morph targets.
    let (faces, body): (Vec<_>, Vec<_>) = avatar.parts.iter().enumerate().partition(|(_, part)| !part.mouth.is_empty());
    nodes.push(json!({ "name": "Avatar", "mesh": 0, "skin": 0 }));
    nodes.push(json!({ "name": "Face", "mesh": 1, "skin": 0 }));
    let mut primitives = |parts: &[(usize, &AvatarMesh)]| -> Vec<Value> {
        parts.iter().map(|(material, part)| primitive(&mut buffer, part, *material)).collect()
    };
    let meshes = json!([
        { "name": "Avatar", "primitives": primitives(&body) },
        { "name": "Face", "primitives": primitives(&faces), "weights": [0.0], "extras": { "targetNames": ["mouthOpen"] } },
    ]);
    let mut scene = json!({
        "asset": { "version": "2.0", "generator": concat!("orator ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "name": "Figure", "nodes": [0, bones.len(), bones.len() + 1] }],
        "nodes": nodes,
        "materials": avatar.parts.iter().map(material).collect::<Vec<_>>(),
        "meshes": meshes,
        "skins": [{
            "inverseBindMatrices": inverse_binds(&mut buffer, rig, clip.root),
            "skeleton": 0,
            "joints": (0..bones.len()).collect::<Vec<_>>(),
        }],
    });
    if clip.n_frames() > 0 {
        scene["animations"] = json!([animation(&mut buffer, clip)]);
    }
    if names == Names::Vrm {
        scene["extensionsUsed"] = json!(["VRMC_vrm"]);
        scene["extensions"] = json!({ "VRMC_vrm": vrm(&own, &called, bones.len() + 1) });
    }
    buffer.file(scene)
}

fn metres(cm: Vec3) -> [f32; 3] {
    cm.map(|v| (v * METRES) as f32)
}

/// Colour of all vertices; `None` where they differ.
fn one_colour(part: &AvatarMesh) -> Option<[f32; 3]> {
    let first = *part.colours.first()?;
    part.colours.iter().all(|colour| *colour == first).then_some(first)
}

fn material(part: &AvatarMesh) -> Value {
    let [r, g, b] = one_colour(part).unwrap_or([1.0; 3]);
    json!({
        "name": format!("{:?}", part.material),
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": part.material.roughness(),
        },
    })
}

fn primitive(buffer: &mut GlbBuffer, part: &AvatarMesh, material: usize) -> Value {
    let points: Vec<[f32; 3]> = part.points.iter().map(|&point| metres(point)).collect();
    let normals: Vec<[f32; 3]> = part.normals.iter().map(|normal| normal.map(|v| v as f32)).collect();
    let (joints, weights): (Vec<[u8; 4]>, Vec<[u16; 4]>) = part.weights.iter().map(whole_shares).unzip();
    let mut primitive = json!({
        "attributes": {
            "POSITION": buffer.floats(&points, "VEC3", BufferUse::Vertices),
            "NORMAL": buffer.floats(&normals, "VEC3", BufferUse::Vertices),
            "JOINTS_0": buffer.bytes4(&joints),
            "WEIGHTS_0": buffer.shares4(&weights),
        },
        "indices": buffer.indices(&part.triangles),
        "material": material,
    });
    if one_colour(part).is_none() {
        let share = |v: f32| (v.clamp(0.0, 1.0) * 65_535.0).round() as u16;
        let colours: Vec<[u16; 4]> =
            part.colours.iter().map(|&[r, g, b]| [share(r), share(g), share(b), u16::MAX]).collect();
        primitive["attributes"]["COLOR_0"] = json!(buffer.shares4(&colours));
    }
    if !part.mouth.is_empty() {
        let open: Vec<[f32; 3]> = part.mouth.iter().map(|&way| metres(way)).collect();
        primitive["targets"] = json!([{ "POSITION": buffer.floats(&open, "VEC3", BufferUse::Vertices) }]);
    }
    primitive
}

/// Weights as 16-bit fractions that sum to 65535, largest first; a joint with weight 0 is joint 0.
fn whole_shares(weights: &crate::animate::avatar::Weights) -> ([u8; 4], [u16; 4]) {
    let mut shares = weights.map(|(_, weight)| (weight * 65_535.0).round() as u16);
    let others: u16 = shares[1..].iter().sum();
    shares[0] = u16::MAX - others;
    let joints = std::array::from_fn(|k| if shares[k] == 0 { 0 } else { weights[k].0 as u8 });
    (joints, shares)
}

fn inverse_binds(buffer: &mut GlbBuffer, rig: &Rig, root: Vec3) -> usize {
    let still = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
    let rest = rig.skeleton.positions(root, &still);
    let matrices: Vec<[f32; 16]> = rest
        .into_iter()
        .map(|place| {
            let [x, y, z] = metres(place).map(|v| 0.0 - v);
            [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0]
        })
        .collect();
    buffer.floats(&matrices, "MAT4", BufferUse::Other)
}

fn animation(buffer: &mut GlbBuffer, clip: &BvhClip) -> Value {
    let times: Vec<[f32; 1]> = (0..clip.n_frames()).map(|frame| [clip.fps.secs(frame) as f32]).collect();
    let once = buffer.floats(&times[..1], "SCALAR", BufferUse::Other);
    let mut every = None;
    let mut samplers =
        vec![json!({ "input": once, "output": buffer.floats(&[metres(clip.root)], "VEC3", BufferUse::Other) })];
    let mut channels = vec![json!({ "sampler": 0, "target": { "node": 0, "path": "translation" } })];
    for joint in (0..clip.skeleton.joints.len()).filter(|&joint| !clip.skeleton.joints[joint].end) {
        let track = quaternions(clip, joint);
        let moves = track.iter().any(|q| (0..4).any(|k| (f64::from(q[k]) - f64::from(track[0][k])).abs() > STILL));
        let (input, output) = if moves {
            (*every.get_or_insert_with(|| buffer.floats(&times, "SCALAR", BufferUse::Other)), &track[..])
        } else {
            (once, &track[..1])
        };
        let output = buffer.floats(output, "VEC4", BufferUse::Other);
        channels.push(json!({ "sampler": samplers.len(), "target": { "node": joint, "path": "rotation" } }));
        samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
    }
    json!({ "name": "Gesture", "samplers": samplers, "channels": channels })
}

/// Quaternions (x, y, z, w) of a joint over time, each with the sign nearest to the one before.
fn quaternions(clip: &BvhClip, joint: usize) -> Vec<[f32; 4]> {
    let mut before = [0.0, 0.0, 0.0, 1.0];
    let next = |local: &Vec<Rotation>| {
        let Rotation { w, v: [x, y, z] } = local[joint];
        let mut q = [x, y, z, w];
        if (0..4).map(|k| q[k] * before[k]).sum::<f64>() < 0.0 {
            q = q.map(|v| -v);
        }
        before = q;
        q.map(|v| v as f32)
    };
    clip.local.iter().map(next).collect()
}

/// VRM 1.0 extension: nodes of the humanoid bones, the open mouth of the node `face`, the avatar's author and licence.
fn vrm(own: &[String], called: &[String], face: usize) -> Value {
    let is_bone = |name: &str| !name.ends_with('4') && !name.ends_with("End");
    let bones: serde_json::Map<String, Value> = own
        .iter()
        .zip(called)
        .enumerate()
        .filter(|(_, (own, _))| is_bone(own))
        .map(|(node, (_, name))| (name.clone(), json!({ "node": node })))
        .collect();
    json!({
        "specVersion": "1.0",
        "meta": { "name": "Avatar", "authors": ["orator"], "licenseUrl": VRM_LICENSE },
        "humanoid": { "humanBones": bones },
        "expressions": {
            "preset": { "aa": { "morphTargetBinds": [{ "node": face, "index": 0, "weight": 1.0 }] } },
        },
    })
}
