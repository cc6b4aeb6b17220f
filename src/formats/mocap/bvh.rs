//! A take from a BVH file: those of the 49 joints that its skeleton has, found by name, at the file's own frame rate.

use super::captured::CapturedMotion;
use super::facing::{AxisAlignment, LengthUnit, TorsoLandmarks};
use super::fingers;
use crate::bvh::read::{Bvh, Positions};
use crate::bvh::{frame_time, joint_names};
use anyhow::{Context, Result, ensure};
use ndarray::Array3;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{self, L_HAND, L_WRIST, N_JOINTS, R_HAND, R_WRIST, Side};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Index into `joint_names::ROLES` of each of joints 0..7 of `types::skeleton`.
const BODY: [usize; 7] = [0, 2, 3, 4, 5, 6, 7];

/// Reads a take, rotated to face the camera. Without `units`, the unit of length is detected from the arms.
///
/// # Errors
///
/// The file is not BVH, its skeleton lacks neck or shoulders, or the person neither stands nor sits upright.
pub fn read(path: &Path, units: Option<LengthUnit>) -> Result<CapturedMotion> {
    read_take(path, units, |alignment| alignment)
}

/// Reads a take without rotation if it is y up and faces +z, as `orator animate` writes it, so that it stays aligned
/// with the motion it came from. A file with other axes is rotated as by [`read`], which its facts record.
pub fn read_unrotated(path: &Path, units: Option<LengthUnit>) -> Result<CapturedMotion> {
    read_take(path, units, |alignment| alignment.unrotated().unwrap_or(alignment))
}

/// Alignment by which [`read_unrotated`] converts a take; `frames` are the positions of its joints.
///
/// # Errors
///
/// Those of [`read`].
pub fn unrotated_alignment(bvh: &Bvh, frames: &[Vec<Vec3>], units: Option<LengthUnit>) -> Result<AxisAlignment> {
    let alignment = AxisAlignment::fit(&torso(bvh, frames)?.1, units)?;
    Ok(alignment.unrotated().unwrap_or(alignment))
}

/// Parses a take from the text of a BVH file, rotated as by [`read`].
pub fn from_text(text: &str) -> Result<CapturedMotion> {
    from_bvh(&Bvh::parse(text)?, None, |alignment| alignment)
}

/// Notes on a take according to its facts: what was assumed when reading the file, and a detected unit other than the
/// centimetre, the usual unit of BVH.
pub fn notes(facts: &Map<String, Value>) -> Vec<String> {
    let of_file = facts.get("source_notes").and_then(Value::as_array).into_iter().flatten();
    let mut notes: Vec<String> = of_file.filter_map(|note| note.as_str().map(str::to_owned)).collect();
    let is_given = facts.contains_key("source_unit_given");
    let unit = facts.get("source_unit").and_then(Value::as_str).filter(|unit| !is_given && *unit != "centimetre");
    notes.extend(unit.map(|unit| format!("judging by the arm length, the unit is the {unit}: converted to metres")));
    notes
}

fn read_take(
    path: &Path,
    units: Option<LengthUnit>,
    align: impl Fn(AxisAlignment) -> AxisAlignment,
) -> Result<CapturedMotion> {
    let bvh = Bvh::read(path)?;
    from_bvh(&bvh, units, align).with_context(|| format!("{} has no usable upper-body motion", path.display()))
}

fn from_bvh(
    bvh: &Bvh,
    units: Option<LengthUnit>,
    align: impl Fn(AxisAlignment) -> AxisAlignment,
) -> Result<CapturedMotion> {
    let frames = bvh.positions(Positions::Auto);
    let (map, landmarks) = torso(bvh, &frames)?;
    let alignment = align(AxisAlignment::fit(&landmarks, units)?);
    let mut joints = Array3::from_elem((frames.len(), N_JOINTS, 3), f32::NAN);
    for (t, (frame, landmarks)) in frames.iter().zip(&landmarks).enumerate() {
        for (joint, at) in map.iter().enumerate() {
            let Some(&position) = at.and_then(|at| frame.get(at)) else { continue };
            for (k, v) in alignment.align_joint(position, landmarks.neck).into_iter().enumerate() {
                joints[[t, joint, k]] = v as f32;
            }
        }
    }
    let missing: Vec<String> = (0..N_JOINTS).filter(|&joint| map[joint].is_none()).map(skeleton::name).collect();
    let facts = json!({
        "source_unit": alignment.unit,
        "source_up": alignment.up,
        "turned_degrees": (alignment.turned_degrees * 100.0).round() / 100.0,
        "joints_missing": missing,
    });
    let mut facts = facts.as_object().cloned().unwrap_or_else(Map::new);
    if units.is_some() {
        facts.insert("source_unit_given".to_owned(), true.into());
    }
    if !bvh.notes.is_empty() {
        facts.insert("source_notes".to_owned(), bvh.notes.clone().into());
    }
    let motion = Motion::from_joints(frame_time::rate(bvh.frame_secs), joints);
    Ok(CapturedMotion { motion, text: None, facts })
}

/// Index of the file's joint for each joint of `types::skeleton`, and the landmarks of each frame.
fn torso(bvh: &Bvh, frames: &[Vec<Vec3>]) -> Result<([Option<usize>; N_JOINTS], Vec<TorsoLandmarks>)> {
    let names: Vec<&str> = bvh.joints.iter().map(|joint| joint.name.as_str()).collect();
    let roles = joint_names::find(&names);
    let map = joint_map(bvh, &names, roles)?;
    let landmarks = frames.iter().map(|frame| landmarks(frame, &map, roles)).collect();
    Ok((map, landmarks))
}

/// Index of the file's joint for each joint of `types::skeleton`. Errors if neck or a shoulder is missing.
fn joint_map(bvh: &Bvh, names: &[&str], roles: [Option<usize>; 10]) -> Result<[Option<usize>; N_JOINTS]> {
    let needed: Vec<&str> =
        [0, 2, 5].into_iter().filter(|&role| roles[role].is_none()).map(|role| joint_names::ROLES[role]).collect();
    ensure!(
        needed.is_empty(),
        "no joint has a name of a {}; the joints are: {}",
        needed.join(", "),
        names.iter().copied().take(40).collect::<Vec<_>>().join(" ")
    );
    let mut map = [None; N_JOINTS];
    for (joint, role) in BODY.into_iter().enumerate() {
        map[joint] = roles[role];
    }
    for (side, wrist, root) in [(Side::Left, L_WRIST, L_HAND), (Side::Right, R_WRIST, R_HAND)] {
        let hand = fingers::hand(bvh, side).unwrap_or_default();
        map[wrist] = map[wrist].or(hand[0]);
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
    TorsoLandmarks {
        neck: at(map[skeleton::NECK]).unwrap_or(missing),
        right_shoulder: at(map[skeleton::R_SHOULDER]).unwrap_or(missing),
        left_shoulder: at(map[skeleton::L_SHOULDER]).unwrap_or(missing),
        hips: hips.unwrap_or(missing),
        arm,
    }
}
