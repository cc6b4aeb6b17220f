//! A performance as a glTF scene: the rig's joints as nodes in T-pose (metres, y up, facing +z), the avatar as skinned
//! meshes, and the clip as one animation. Static joints have a single key.

use super::glb::{BufferUse, GlbBuffer};
use super::vrm;
use crate::animate::avatar::{Avatar, AvatarMesh, Weights};
use crate::animate::rig::file_skeleton::{FileSkeleton, RestAxes};
use crate::animate::rig::names::Names;
use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use orator_formats::bvh::write::BvhClip;
use serde_json::{Value, json};

const METRES: f64 = 0.01;
/// Maximum difference between the quaternions of a static joint.
const STATIC_DIFFERENCE: f64 = 1e-7;
/// Bytes of the GLB file of a clip on its rig, with `avatar` as its skin. With VRM names it is also a VRM humanoid.
pub fn file(rig: &Rig, clip: &BvhClip, avatar: &Avatar, names: Names) -> Vec<u8> {
    let skeleton = FileSkeleton::new(&rig.skeleton, names, RestAxes::Convention);
    let mut buffer = GlbBuffer::default();
    let mut scene = scene(&mut buffer, &skeleton, clip.root, avatar);
    if clip.n_frames() > 0 {
        scene["animations"] = json!([animation(&mut buffer, &skeleton.clip(clip))]);
    }
    if names == Names::Vrm {
        vrm::make_humanoid(&mut scene, &skeleton.skeleton);
    }
    buffer.file(scene)
}

/// Scene of the avatar at rest with the hips at `root`: one node per joint, then the nodes of the body and face meshes.
pub fn scene(buffer: &mut GlbBuffer, skeleton: &FileSkeleton, root: Vec3, avatar: &Avatar) -> Value {
    let n_joints = skeleton.rest.len();
    let mut nodes = joint_nodes(skeleton, root);
    // The face is a separate mesh because all primitives of a mesh must have the same morph targets.
    let (faces, body): (Vec<_>, Vec<_>) = avatar.parts.iter().enumerate().partition(|(_, part)| !part.mouth.is_empty());
    nodes.push(json!({ "name": "Avatar", "mesh": 0, "skin": 0 }));
    nodes.push(json!({ "name": "Face", "mesh": 1, "skin": 0 }));
    let mut primitives = |parts: &[(usize, &AvatarMesh)]| -> Vec<Value> {
        parts.iter().map(|(material, part)| primitive(buffer, part, *material, &skeleton.of_rig)).collect()
    };
    let meshes = json!([
        { "name": "Avatar", "primitives": primitives(&body) },
        { "name": "Face", "primitives": primitives(&faces), "weights": [0.0], "extras": { "targetNames": ["mouthOpen"] } },
    ]);
    json!({
        "asset": asset(),
        "scene": 0,
        "scenes": [{ "name": "Figure", "nodes": [0, n_joints, n_joints + 1] }],
        "nodes": nodes,
        "materials": avatar.parts.iter().map(material).collect::<Vec<_>>(),
        "meshes": meshes,
        "skins": [{
            "inverseBindMatrices": inverse_binds(buffer, skeleton, root),
            "skeleton": 0,
            "joints": (0..n_joints).collect::<Vec<_>>(),
        }],
    })
}

/// The `asset` object: format version and generator.
pub fn asset() -> Value {
    json!({ "version": "2.0", "generator": concat!("orator ", env!("CARGO_PKG_VERSION")) })
}

pub fn joint_nodes(skeleton: &FileSkeleton, root: Vec3) -> Vec<Value> {
    let node = |(joint, rest): (usize, Rotation)| {
        let bone = &skeleton.skeleton.joints[joint];
        let at = bone.parent.map_or(root, |_| bone.offset);
        let mut node = json!({ "name": bone.name, "translation": metres(at) });
        if rest != Rotation::IDENTITY {
            let Rotation { w, v: [x, y, z] } = rest;
            node["rotation"] = json!([x, y, z, w].map(|v| v as f32));
        }
        let children: Vec<usize> = skeleton.skeleton.children(joint).collect();
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        node
    };
    skeleton.rest_local().into_iter().enumerate().map(node).collect()
}

fn metres(cm: Vec3) -> [f32; 3] {
    cm.map(|v| (v * METRES) as f32)
}

/// The common colour of all vertices; `None` if they differ.
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

fn primitive(buffer: &mut GlbBuffer, part: &AvatarMesh, material: usize, of_rig: &[usize]) -> Value {
    let points: Vec<[f32; 3]> = part.points.iter().map(|&point| metres(point)).collect();
    let normals: Vec<[f32; 3]> = part.normals.iter().map(|normal| normal.map(|v| v as f32)).collect();
    let (joints, weights): (Vec<[u8; 4]>, Vec<[u16; 4]>) =
        part.weights.iter().map(|weights| quantised_weights(weights, of_rig)).unzip();
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

/// Weights as 16-bit fractions that sum to 65535, largest first; joints with weight 0 are set to joint 0.
fn quantised_weights(weights: &Weights, of_rig: &[usize]) -> ([u8; 4], [u16; 4]) {
    let mut shares = weights.map(|(_, weight)| (weight * 65_535.0).round() as u16);
    let others: u16 = shares[1..].iter().sum();
    shares[0] = u16::MAX - others;
    let joints = std::array::from_fn(|k| if shares[k] == 0 { 0 } else { of_rig[weights[k].0] as u8 });
    (joints, shares)
}

fn inverse_binds(buffer: &mut GlbBuffer, skeleton: &FileSkeleton, root: Vec3) -> usize {
    let back = |(turn, place): (&Rotation, Vec3)| {
        let back = turn.inverse();
        let [a, b, c] = back.axes().map(|axis| axis.map(|v| v as f32));
        let [x, y, z] = metres(back.turn(place)).map(|v| 0.0 - v);
        [a[0], a[1], a[2], 0.0, b[0], b[1], b[2], 0.0, c[0], c[1], c[2], 0.0, x, y, z, 1.0]
    };
    let matrices: Vec<[f32; 16]> = skeleton.rest.iter().zip(skeleton.rest_positions(root)).map(back).collect();
    buffer.floats(&matrices, "MAT4", BufferUse::Other)
}

pub fn animation(buffer: &mut GlbBuffer, clip: &BvhClip) -> Value {
    let times: Vec<[f32; 1]> = (0..clip.n_frames()).map(|frame| [clip.fps.secs(frame) as f32]).collect();
    let once = buffer.floats(&times[..1], "SCALAR", BufferUse::Other);
    let mut every = None;
    let roots: Vec<[f32; 3]> = (0..clip.n_frames()).map(|frame| metres(clip.root_at(frame))).collect();
    let (input, roots) = if clip.travel.is_empty() {
        (once, &roots[..1])
    } else {
        (*every.get_or_insert_with(|| buffer.floats(&times, "SCALAR", BufferUse::Other)), &roots[..])
    };
    let mut samplers = vec![json!({ "input": input, "output": buffer.floats(roots, "VEC3", BufferUse::Other) })];
    let mut channels = vec![json!({ "sampler": 0, "target": { "node": 0, "path": "translation" } })];
    for joint in (0..clip.skeleton.joints.len()).filter(|&joint| !clip.skeleton.joints[joint].end) {
        let track = with_continuous_signs(clip.local.iter().map(|local| local[joint]));
        let moves =
            track.iter().any(|q| (0..4).any(|k| (f64::from(q[k]) - f64::from(track[0][k])).abs() > STATIC_DIFFERENCE));
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

/// Quaternions (x, y, z, w) of a joint over time, each with the sign that is nearer to its predecessor.
pub fn with_continuous_signs(rotations: impl Iterator<Item = Rotation>) -> Vec<[f32; 4]> {
    let mut before = [0.0, 0.0, 0.0, 1.0];
    let next = |rotation: Rotation| {
        let Rotation { w, v: [x, y, z] } = rotation;
        let mut q = [x, y, z, w];
        if (0..4).map(|k| q[k] * before[k]).sum::<f64>() < 0.0 {
            q = q.map(|v| -v);
        }
        before = q;
        q.map(|v| v as f32)
    };
    rotations.map(next).collect()
}
