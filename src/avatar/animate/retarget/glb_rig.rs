//! A user's skeleton in a GLB or VRM file, and the file with an animation appended; nodes, meshes and animations are
//! preserved, but moved nodes with a matrix get translation, rotation and scale, since glTF animates only these.

use super::user_rig::{UserJoint, UserRig};
use crate::animate::export::glb::{BufferUse, GlbBuffer};
use crate::animate::export::glb_scene::with_continuous_signs;
use anyhow::{Context as _, Result, ensure};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, cross, dot, norm, unit};
use orator_base::text::number;
use orator_base::types::time::FrameRate;
use orator_formats::bvh::read::MAX_JOINTS;
use orator_formats::skeleton::joint_names;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum relative difference of the three scale factors of a node.
const MAX_SCALE_DIFFERENCE: f64 = 1e-3;
/// Maximum cosine of the angle between two axes of a matrix without shear.
const MAX_SHEAR: f64 = 1e-3;
/// Maximum size of the scene's JSON, which takes several times as much memory once parsed, bytes.
const MAX_SCENE_BYTES: u32 = 32 << 20;

/// The contents of a GLB file and its skeleton.
#[derive(Clone, Debug)]
pub struct GlbRig {
    scene: Value,
    bytes: Vec<u8>,
    /// Node index of each joint.
    nodes: Vec<usize>,
    rig: UserRig,
}

impl GlbRig {
    /// Parses a file.
    ///
    /// # Errors
    /// The bytes are not a GLB file, buffers are in other files, or the nodes do not form a tree.
    pub fn new(file: &[u8]) -> Result<Self> {
        let (scene, bytes) = chunks(file)?;
        let buffers = scene["buffers"].as_array().map_or(0, Vec::len);
        let is_outside = scene["buffers"].as_array().into_iter().flatten().any(|buffer| buffer.get("uri").is_some());
        ensure!(buffers <= 1 && !is_outside, "its buffers are in other files: export the scene as a single .glb");
        let list = |key: &str| scene[key].as_array().into_iter().flatten();
        let n_nodes = list("nodes").count();
        ensure!(n_nodes <= MAX_JOINTS, "{n_nodes} nodes, expected at most {MAX_JOINTS}: export only the character");
        let nodes = list("nodes").enumerate().map(|(n, node)| {
            SceneNode::deserialize(node).with_context(|| format!("node {n} is not a valid glTF 2.0 node"))
        });
        let nodes: Vec<SceneNode> = nodes.collect::<Result<_>>()?;
        let skin_joints = list("skins").flat_map(|skin| skin["joints"].as_array().into_iter().flatten());
        let skin_joints: BTreeSet<u64> = skin_joints.filter_map(Value::as_u64).collect();
        let has_skin = list("skins").next().is_some();
        let bone_nodes = humanoid_nodes(&scene);
        let may_move = |node: usize| {
            let is_bone = bone_nodes.iter().any(|(_, bone)| *bone == node);
            !has_skin || skin_joints.contains(&(node as u64)) || is_bone
        };
        let mut is_child = vec![false; nodes.len()];
        for &child in nodes.iter().flat_map(|node| &node.children) {
            let has_parent = is_child.get_mut(child).with_context(|| format!("child node {child} does not exist"))?;
            ensure!(!*has_parent, "node {child} has two parents");
            *has_parent = true;
        }
        let mut stack: Vec<(usize, Option<usize>)> =
            (0..nodes.len()).rev().filter(|&node| !is_child[node]).map(|node| (node, None)).collect();
        let (mut order, mut joints) = (Vec::new(), Vec::new());
        while let Some((node, parent)) = stack.pop() {
            let at = joints.len();
            joints.push(nodes[node].joint(node, parent, may_move(node))?);
            order.push(node);
            stack.extend(nodes[node].children.iter().rev().map(|&child| (child, Some(at))));
        }
        ensure!(joints.len() == nodes.len(), "the nodes do not form a tree");
        let bone_names: Vec<&str> = bone_nodes.iter().map(|(name, _)| *name).collect();
        let assigned = joint_names::match_names(&bone_names).into_iter();
        let joint_of = |(own, bone): (String, usize)| {
            let joint = order.iter().position(|node| *node == bone_nodes[bone].1)?;
            Some((own, joint))
        };
        let humanoid: BTreeMap<String, usize> = assigned.filter_map(joint_of).collect();
        Ok(Self { rig: UserRig { joints, humanoid, ..UserRig::default() }, nodes: order, scene, bytes })
    }

    /// The skeleton at rest.
    pub fn rig(&self) -> &UserRig {
        &self.rig
    }

    /// Bytes of the file with an appended animation; `frames` yields the local rotations of all joints for each frame,
    /// of which those of moving joints are used.
    pub fn file(
        &self,
        fps: FrameRate,
        frames: impl ExactSizeIterator<Item = Vec<Rotation>>,
        moves: impl Fn(usize) -> bool,
    ) -> Vec<u8> {
        let mut scene = self.scene.clone();
        let mut buffer = GlbBuffer::from_scene(&scene, self.bytes.clone());
        let n_frames = frames.len();
        let mut tracks: Vec<(usize, Vec<Rotation>)> = (0..self.rig.joints.len())
            .filter(|&joint| moves(joint))
            .map(|joint| (joint, Vec::with_capacity(n_frames)))
            .collect();
        for local in frames {
            tracks.iter_mut().for_each(|(joint, track)| track.push(local[*joint]));
        }
        if n_frames > 0 {
            let times: Vec<[f32; 1]> = (0..n_frames).map(|frame| [fps.secs(frame) as f32]).collect();
            let input = buffer.floats(&times, "SCALAR", BufferUse::Other);
            let (mut samplers, mut channels) = (Vec::new(), Vec::new());
            for (joint, track) in tracks {
                self.decompose(joint, &mut scene);
                let output = buffer.floats(&with_continuous_signs(track.into_iter()), "VEC4", BufferUse::Other);
                let target = json!({ "node": self.nodes[joint], "path": "rotation" });
                channels.push(json!({ "sampler": samplers.len(), "target": target }));
                samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
            }
            let animation = json!({ "name": "Gesture", "samplers": samplers, "channels": channels });
            match scene["animations"].as_array_mut() {
                Some(animations) => animations.push(animation),
                None => scene["animations"] = json!([animation]),
            }
        }
        buffer.file(scene)
    }

    /// Replaces the matrix of a joint's node, if there is one, by translation, rotation and scale.
    fn decompose(&self, joint: usize, scene: &mut Value) {
        let Some(node) = scene["nodes"][self.nodes[joint]].as_object_mut() else { return };
        if node.remove("matrix").is_some() {
            let UserJoint { offset, rest: Rotation { w, v: [x, y, z] }, scale, .. } = self.rig.joints[joint];
            node.insert("translation".to_owned(), json!(offset));
            node.insert("rotation".to_owned(), json!([x, y, z, w]));
            node.insert("scale".to_owned(), json!([scale, scale, scale]));
        }
    }
}

/// Nodes that a VRM file (1.0 or 0.x) assigns to humanoid bones, with the names of these bones; at most `MAX_JOINTS`.
fn humanoid_nodes(scene: &Value) -> Vec<(&str, usize)> {
    let node = |bone: &Value| bone["node"].as_u64().map(|node| node as usize);
    let bones = |extension: &str| &scene["extensions"][extension]["humanoid"]["humanBones"];
    let current = bones("VRMC_vrm").as_object().into_iter().flatten();
    let former = bones("VRM").as_array().into_iter().flatten();
    let current = current.filter_map(|(name, bone)| Some((name.as_str(), node(bone)?)));
    let former = former.filter_map(|bone| Some((bone["bone"].as_str()?, node(bone)?)));
    current.chain(former).take(MAX_JOINTS).collect()
}

/// Splits a GLB file into its scene and its binary data.
///
/// # Errors
/// The bytes are not a GLB file, or the JSON exceeds `MAX_SCENE_BYTES`, which suffices for `MAX_JOINTS` nodes with
/// their meshes and animations.
fn chunks(file: &[u8]) -> Result<(Value, Vec<u8>)> {
    let length = file.get(12..16).map_or(0, |word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let mib = length >> 20;
    ensure!(
        length <= MAX_SCENE_BYTES,
        "the scene has {mib} MiB of JSON, expected at most {} MiB: export only the character",
        MAX_SCENE_BYTES >> 20
    );
    parsed_chunks(file).context("not a binary glTF 2.0 file (.glb)")
}

fn parsed_chunks(file: &[u8]) -> Option<(Value, Vec<u8>)> {
    let word = |at: usize| Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?) as usize);
    if file.get(..4)? != b"glTF" || word(4)? != 2 || file.get(16..20)? != b"JSON" {
        return None;
    }
    let length = word(12)?;
    let scene: Value = serde_json::from_slice(file.get(20..20 + length)?).ok()?;
    let bytes = match file.get(20 + length..) {
        None | Some([]) => Vec::new(),
        Some(_) => file.get(28 + length..28 + length + word(20 + length)?)?.to_vec(),
    };
    scene.is_object().then_some((scene, bytes))
}

#[derive(Debug, Deserialize)]
#[serde(default)]
struct SceneNode {
    name: Option<String>,
    children: Vec<usize>,
    /// Columns of the local transform.
    matrix: Option<[f64; 16]>,
    translation: Vec3,
    rotation: [f64; 4],
    scale: Vec3,
}

impl Default for SceneNode {
    fn default() -> Self {
        let (translation, rotation, scale) = ([0.0; 3], [0.0, 0.0, 0.0, 1.0], [1.0; 3]);
        Self { name: None, children: Vec::new(), matrix: None, translation, rotation, scale }
    }
}

impl SceneNode {
    fn joint(&self, index: usize, parent: Option<usize>, moves: bool) -> Result<UserJoint> {
        let name = self.name.clone().unwrap_or_else(|| format!("node {index}"));
        let (offset, rest, factors, is_sheared) = match &self.matrix {
            Some(matrix) => decomposed(matrix),
            None => {
                let [x, y, z, w] = self.rotation;
                let length = (x * x + y * y + z * z + w * w).sqrt();
                ensure!(length > 1e-6, "invalid rotation {:?} of {name}: expected a unit quaternion", self.rotation);
                let rest = Rotation { w: w / length, v: [x / length, y / length, z / length] };
                (self.translation, rest, self.scale, false)
            }
        };
        let [x, y, z] = factors;
        let is_uniform = (x - y).abs().max((x - z).abs()) <= MAX_SCALE_DIFFERENCE * x.abs();
        let scale_error = (is_sheared || !is_uniform || x <= 0.0).then(|| {
            format!(
                "scale {}, {}, {}{} of {name}: expected a uniform positive scale of the bones and their parents; apply \
                 the scale and export again",
                number(x),
                number(y),
                number(z),
                if is_sheared { " with shear" } else { "" }
            )
        });
        Ok(UserJoint { name, parent, offset, rest, scale: x, scale_error, moves })
    }
}

/// Translation, rotation, scale factors of a matrix, whether its axes are skewed. Those of a reflection are negative.
pub fn decomposed(matrix: &[f64; 16]) -> (Vec3, Rotation, Vec3, bool) {
    let column = |k: usize| [matrix[4 * k], matrix[4 * k + 1], matrix[4 * k + 2]];
    let columns = [0, 1, 2].map(column);
    let sign = if dot(cross(columns[0], columns[1]), columns[2]) < 0.0 { -1.0 } else { 1.0 };
    let factors = columns.map(|axis| sign * norm(axis));
    let [x, y, z] = columns.map(|axis| unit(axis, 0.0).unwrap_or_default().map(|v| sign * v));
    let is_sheared = [dot(x, y), dot(y, z), dot(z, x)].iter().any(|cos| cos.abs() > MAX_SHEAR);
    (column(3), Rotation::from_axes(x, y, z), factors, is_sheared)
}
