//! Joint rotations and the hip translation over time as FBX curves: Euler angles about x, y and z in degrees, one key
//! per frame, linear between keys. Two triples of angles (plus full turns) give each rotation; the one nearest to the
//! previous frame is used, so that the curves have no jumps.

use super::binary::{FbxNode, FbxValue};
use super::document::{FbxObjects, properties, property, ticks};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use orator_formats::bvh::write::BvhClip;

pub const TAKE: &str = "Gesture";
/// Maximum change of the angles of a static joint, degrees; a static joint has a single key.
const STATIC_DEGREES: f64 = 1e-5;
/// Linear interpolation at every key.
const LINEAR: i32 = 4;
const KEY_VERSION: i32 = 4008;

/// Adds the animation of a clip; `models` are the ids of its joints.
pub fn add(objects: &mut FbxObjects, clip: &BvhClip, models: &[i64]) {
    let last = ticks(clip.fps, clip.n_frames().saturating_sub(1));
    let span = [("LocalStart", 0), ("LocalStop", last), ("ReferenceStart", 0), ("ReferenceStop", last)]
        .map(|(name, time)| property(name, ["KTime", "Time", ""], vec![time.into()]));
    let stack = objects.add("AnimationStack", (TAKE, "AnimStack", ""), [properties(span)]);
    let layer = objects.add("AnimationLayer", ("BaseLayer", "AnimLayer", ""), [properties([])]);
    objects.connect(layer, stack);
    let times: Vec<i64> = (0..clip.n_frames()).map(|frame| ticks(clip.fps, frame)).collect();
    for (joint, &model) in models.iter().enumerate() {
        if clip.skeleton.joints[joint].end {
            continue;
        }
        let angles = degrees(clip.local.iter().map(|local| local[joint]));
        let Some(&first) = angles.first() else { continue };
        let moves = angles.iter().any(|now| (0..3).any(|k| (now[k] - first[k]).abs() > STATIC_DEGREES));
        let angles = if moves { &angles[..] } else { &angles[..1] };
        add_curves(objects, (layer, model), ("R", "Lcl Rotation"), angles, &times);
    }
    if let Some(&hips) = models.first().filter(|_| !clip.travel.is_empty()) {
        let places: Vec<Vec3> = (0..clip.n_frames()).map(|frame| clip.root_at(frame)).collect();
        add_curves(objects, (layer, hips), ("T", "Lcl Translation"), &places, &times);
    }
}

/// Connects curves of three values over time to a model. A single value stands for all times.
fn add_curves(
    objects: &mut FbxObjects,
    (layer, model): (i64, i64),
    (name, of_model): (&'static str, &'static str),
    track: &[Vec3],
    times: &[i64],
) {
    let Some(&first) = track.first() else { return };
    let channels: Vec<FbxNode> = ["d|X", "d|Y", "d|Z"]
        .into_iter()
        .zip(first)
        .map(|(channel, value)| property(channel, ["Number", "", "A"], vec![value.into()]))
        .collect();
    let node = objects.add("AnimationCurveNode", (name, "AnimCurveNode", ""), [properties(channels)]);
    objects.connect(node, layer);
    objects.connect_property(node, model, of_model);
    for (axis, channel) in ["d|X", "d|Y", "d|Z"].into_iter().enumerate() {
        let values: Vec<f32> = track.iter().map(|now| now[axis] as f32).collect();
        let keys = [
            FbxNode::one("Default", first[axis]),
            FbxNode::one("KeyVer", KEY_VERSION),
            FbxNode::one("KeyTime", FbxValue::Longs(times[..values.len()].to_vec())),
            FbxNode::one("KeyAttrFlags", FbxValue::Ints(vec![LINEAR])),
            FbxNode::one("KeyAttrDataFloat", FbxValue::Floats(vec![0.0; 4])),
            FbxNode::one("KeyAttrRefCount", FbxValue::Ints(vec![values.len() as i32])),
            FbxNode::one("KeyValueFloat", FbxValue::Floats(values)),
        ];
        let curve = objects.add("AnimationCurve", ("", "AnimCurve", ""), keys);
        objects.connect_property(curve, node, channel);
    }
}

/// Euler angles about x, y and z, degrees, of a rotation that applies x first, then y, then z.
pub fn angles(rotation: Rotation) -> Vec3 {
    let [z, y, x] = rotation.euler([2, 1, 0]);
    [x, y, z].map(f64::to_degrees)
}

/// Euler angles over time without jumps, degrees.
pub fn degrees(rotations: impl Iterator<Item = Rotation>) -> Vec<Vec3> {
    let mut before: Option<Vec3> = None;
    let next = |rotation: Rotation| {
        let [x, y, z] = angles(rotation);
        let Some(last) = before else {
            before = Some([x, y, z]);
            return [x, y, z];
        };
        let near = |given: Vec3| std::array::from_fn(|k| given[k] + 360.0 * ((last[k] - given[k]) / 360.0).round());
        let apart = |given: &Vec3| (0..3).map(|k| (given[k] - last[k]).abs()).fold(0.0, f64::max);
        let (one, other): (Vec3, Vec3) = (near([x, y, z]), near([x + 180.0, 180.0 - y, z + 180.0]));
        let nearest = if apart(&other) < apart(&one) { other } else { one };
        before = Some(nearest);
        nearest
    };
    rotations.map(next).collect()
}
