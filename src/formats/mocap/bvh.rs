//! A take from a BVH file, or from an `.npz` of SMPL-X: those of the 49 joints that its skeleton has, found by name or
//! else by structure, at the file's own frame rate. The neck of a skeleton without one is the middle of the shoulders.

use super::captured::CapturedMotion;
use super::facing::{AxisAlignment, LengthUnit, TorsoLandmarks};
use super::fingers;
use super::smplx::motion::SmplxMotion;
use crate::bvh::frame_time;
use crate::bvh::read::{Bvh, Positions};
use crate::bvh::skeleton::JointChannels;
use crate::skeleton::joint_names::{self, ROLE_BONES};
use crate::skeleton::matched::{MatchJoint, MatchedJoints};
use anyhow::{Context, Result, ensure};
use ndarray::Array3;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{self, L_HAND, L_WRIST, N_JOINTS, R_HAND, R_WRIST, Side};
use orator_base::types::time::FrameRate;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Index into `joint_names::ROLES` of each of joints 0..7 of `types::skeleton`.
const BODY: [usize; 7] = [0, 2, 3, 4, 5, 6, 7];
/// Bones without which there is no upper body.
const REQUIRED: [&str; 2] = ["LeftArm", "RightArm"];

/// Unit of length and frame rate of a file, as far as the caller knows them.
#[derive(Clone, Copy, Debug, Default)]
pub struct GivenScale {
    /// Unit of a BVH file; detected from the arms without it.
    pub units: Option<LengthUnit>,
    /// Frame rate of an `.npz` that does not state it.
    pub fps: Option<FrameRate>,
}

/// Opens a BVH file, or an `.npz` of SMPL-X as such a file in metres; returns its unit of length too, if known.
fn open(path: &Path, given: GivenScale) -> Result<(Bvh, Option<LengthUnit>)> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz")) {
        return Ok((SmplxMotion::read(path, given.fps)?.bvh(), Some(LengthUnit::METRE)));
    }
    Ok((Bvh::read(path)?, given.units))
}

/// Reads a take, rotated to face the camera.
///
/// # Errors
///
/// The file is not of its kind, its skeleton lacks a shoulder, or the person neither stands nor sits upright.
pub fn read(path: &Path, given: GivenScale) -> Result<CapturedMotion> {
    read_take(path, given, |alignment| alignment)
}

/// Reads a take without rotation if it is y up and faces +z, as `orator animate` writes it, so that it stays aligned
/// with the motion it came from. A file with other axes is rotated as by [`read`], which its facts record.
pub fn read_unrotated(path: &Path, given: GivenScale) -> Result<CapturedMotion> {
    read_take(path, given, |alignment| alignment.unrotated().unwrap_or(alignment))
}

/// Alignment by which [`read_unrotated`] converts a take; `frames` are the positions of its joints.
pub fn unrotated_alignment(bvh: &Bvh, frames: &[Vec<Vec3>], units: Option<LengthUnit>) -> Result<AxisAlignment> {
    let alignment = AxisAlignment::fit(&torso(bvh, frames)?.1, units)?;
    Ok(alignment.unrotated().unwrap_or(alignment))
}

/// Parses a take from the text of a BVH file, rotated as by [`read`].
pub fn from_text(text: &str) -> Result<CapturedMotion> {
    from_bvh(&Bvh::parse(text)?, None, |alignment| alignment)
}

/// Notes on a take according to its facts: what was assumed when reading the file, a detected unit other than the
/// centimetre, the usual unit of BVH, a neck that is the middle of the shoulders, and joints found by structure.
pub fn notes(facts: &Map<String, Value>) -> Vec<String> {
    let of_file = facts.get("source_notes").and_then(Value::as_array).into_iter().flatten();
    let mut notes: Vec<String> = of_file.filter_map(|note| note.as_str().map(str::to_owned)).collect();
    let text = |key: &str| facts.get(key).and_then(Value::as_str);
    let is_given = facts.contains_key("source_unit_given");
    let unit = text("source_unit").filter(|unit| !is_given && *unit != "centimetre");
    let unit = unit.map(|unit| format!("judging by the arm length, the unit is the {unit}: converted to metres"));
    let neck = text("neck").map(|neck| format!("the skeleton has no neck: the {neck} takes its position"));
    let structure = text("joints_by_structure").map(|joints| {
        format!(
            "joints with unknown names were found by the structure of the skeleton: {joints}; if one is wrong, rename \
             the joints in the file, for instance to LeftArm, LeftForeArm and LeftHand"
        )
    });
    notes.extend(unit.into_iter().chain(neck).chain(structure));
    notes
}

fn read_take(path: &Path, given: GivenScale, align: impl Fn(AxisAlignment) -> AxisAlignment) -> Result<CapturedMotion> {
    let (bvh, units) = open(path, given)?;
    from_bvh(&bvh, units, align).with_context(|| format!("{} has no usable upper-body motion", path.display()))
}

fn from_bvh(
    bvh: &Bvh,
    units: Option<LengthUnit>,
    align: impl Fn(AxisAlignment) -> AxisAlignment,
) -> Result<CapturedMotion> {
    let frames = bvh.positions(Positions::Auto);
    let (JointMap { joints: map, matched }, landmarks) = torso(bvh, &frames)?;
    let alignment = align(AxisAlignment::fit(&landmarks, units)?);
    let mut joints = Array3::from_elem((frames.len(), N_JOINTS, 3), f32::NAN);
    for (t, (frame, landmarks)) in frames.iter().zip(&landmarks).enumerate() {
        for (joint, at) in map.iter().enumerate() {
            let is_neck = joint == skeleton::NECK;
            let position = if is_neck { Some(landmarks.neck) } else { at.and_then(|at| frame.get(at).copied()) };
            let Some(position) = position else { continue };
            for (k, v) in alignment.align_joint(position, landmarks.neck).into_iter().enumerate() {
                joints[[t, joint, k]] = v as f32;
            }
        }
    }
    let is_missing = |&joint: &usize| map[joint].is_none() && joint != skeleton::NECK;
    let missing: Vec<String> = (0..N_JOINTS).filter(is_missing).map(skeleton::name).collect();
    let mut facts = json!({
        "source_unit": alignment.unit,
        "source_up": alignment.up,
        "turned_degrees": (alignment.turned_degrees * 100.0).round() / 100.0,
        "joints_missing": missing,
    });
    if map[skeleton::NECK].is_none() {
        facts["neck"] = json!("middle of the shoulders");
    }
    if !matched.by_structure.is_empty() {
        let named = |own: &String| format!("{own} = {}", bvh.joints[matched.joints[own]].name);
        facts["joints_by_structure"] = json!(matched.by_structure.iter().map(named).collect::<Vec<_>>().join(", "));
    }
    if units.is_some() {
        facts["source_unit_given"] = json!(true);
    }
    if !bvh.notes.is_empty() {
        facts["source_notes"] = json!(bvh.notes);
    }
    let motion = Motion::from_joints(frame_time::rate(bvh.frame_secs), joints);
    Ok(CapturedMotion { motion, text: None, facts: facts.as_object().cloned().unwrap_or_else(Map::new) })
}

struct JointMap {
    /// Index of the file's joint for each joint of `types::skeleton`.
    joints: [Option<usize>; N_JOINTS],
    matched: MatchedJoints,
}

/// The joints of the file, and the landmarks of each frame.
fn torso(bvh: &Bvh, frames: &[Vec<Vec3>]) -> Result<(JointMap, Vec<TorsoLandmarks>)> {
    let names: Vec<&str> = bvh.joints.iter().map(|joint| joint.name.as_str()).collect();
    let first = frames.first().map_or(&[][..], Vec::as_slice);
    let joint = |(n, joint): (usize, &JointChannels)| MatchJoint {
        name: names[n],
        parent: joint.parent,
        position: first.get(n).copied().unwrap_or_default(),
        moves: !joint.channels.is_empty(),
    };
    let joints: Vec<MatchJoint> = bvh.joints.iter().enumerate().map(joint).collect();
    let matched = MatchedJoints::with_named(joint_names::match_names(&names), &joints, &REQUIRED);
    let roles = ROLE_BONES.map(|bone| matched.joints.get(bone).copied());
    let map = JointMap { joints: joint_map(bvh, &names, roles, &matched)?, matched };
    let landmarks = frames.iter().map(|frame| landmarks(frame, &map.joints, roles)).collect();
    Ok((map, landmarks))
}

/// Index of the file's joint for each joint of `types::skeleton`. Errors if a shoulder is missing.
fn joint_map(
    bvh: &Bvh,
    names: &[&str],
    roles: [Option<usize>; 10],
    matched: &MatchedJoints,
) -> Result<[Option<usize>; N_JOINTS]> {
    let needed: Vec<&str> =
        [2, 5].into_iter().filter(|&role| roles[role].is_none()).map(|role| joint_names::ROLES[role]).collect();
    ensure!(
        needed.is_empty(),
        "no joint has a name or the position of a {}; the joints are: {}",
        needed.join(", "),
        names.iter().copied().take(40).collect::<Vec<_>>().join(" ")
    );
    let mut map = [None; N_JOINTS];
    for (joint, role) in BODY.into_iter().enumerate() {
        map[joint] = roles[role];
    }
    for (side, wrist, root) in [(Side::Left, L_WRIST, L_HAND), (Side::Right, R_WRIST, R_HAND)] {
        let hand = fingers::hand(bvh, side).or_else(|| fingers::matched_hand(bvh, &matched.joints, side));
        let hand = hand.unwrap_or_default();
        // The forearm of a skeleton without hands ends at the wrist.
        let is_end = |joint: &JointChannels, elbow| joint.channels.is_empty() && joint.parent == Some(elbow);
        let end = |elbow: usize| bvh.joints.iter().position(|joint| is_end(joint, elbow));
        map[wrist] = map[wrist].or(hand[0]).or_else(|| map[wrist - 1].and_then(end));
        map[root + 1..root + hand.len()].copy_from_slice(&hand[1..]);
        map[root] = map[wrist];
    }
    Ok(map)
}

fn landmarks(frame: &[Vec3], map: &[Option<usize>; N_JOINTS], roles: [Option<usize>; 10]) -> TorsoLandmarks {
    let at = |joint: Option<usize>| joint.and_then(|j| frame.get(j).copied());
    let bone = |a: usize, b: usize| Some(vec3::norm(vec3::sub(at(map[a])?, at(map[b])?)));
    let arm = |shoulder: usize| Some(bone(shoulder, shoulder + 1)? + bone(shoulder + 1, shoulder + 2)?);
    let arm = match (arm(skeleton::R_SHOULDER), arm(skeleton::L_SHOULDER)) {
        (Some(right), Some(left)) => Some((right + left) / 2.0),
        (right, left) => right.or(left),
    };
    let hips = match (at(roles[8]), at(roles[9])) {
        (Some(right), Some(left)) => Some(vec3::scale(vec3::add(right, left), 0.5)),
        _ => frame.first().copied(),
    };
    let missing = [f64::NAN; 3];
    let [right_shoulder, left_shoulder] =
        [skeleton::R_SHOULDER, skeleton::L_SHOULDER].map(|shoulder| at(map[shoulder]).unwrap_or(missing));
    let middle = || vec3::scale(vec3::add(right_shoulder, left_shoulder), 0.5);
    TorsoLandmarks {
        neck: at(map[skeleton::NECK]).unwrap_or_else(middle),
        right_shoulder,
        left_shoulder,
        hips: hips.unwrap_or(missing),
        arm,
    }
}
