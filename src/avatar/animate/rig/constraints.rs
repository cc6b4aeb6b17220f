//! Plausibility constraints (Rebol et al. 2021): joint limits, and neighbouring fingers that curl together. Frames are
//! changed independently; angles within the limits are unchanged, clamped ones are counted by kind, and continuous
//! motion stays continuous. The limits are defined in `limits`.

use super::hinge::Bend;
use super::limits::{self, CURL_COHERENCE, Limit, clamp_circular, turn};
use super::rig::Rig;
use crate::animate::solve::arm_pose::ArmPose;
use crate::animate::solve::track::smoothstep;
use orator_base::math::rotation::Rotation;
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Constraints {
    /// Whether to apply the limits of every joint.
    pub limits: bool,
    /// Whether to keep fingers within 10 degrees of their mean curl. It also bends a pointing finger: off by default.
    pub curl_coherence: bool,
}

impl Default for Constraints {
    fn default() -> Self {
        Self { limits: true, curl_coherence: false }
    }
}

impl Constraints {
    pub const NONE: Self = Self { limits: false, curl_coherence: false };

    /// Constrains one frame of local rotations.
    pub fn apply(self, rig: &Rig, local: &mut [Rotation], counter: &mut ClampCounter) {
        if self == Self::NONE {
            return;
        }
        counter.n_frames += 1;
        for arm in &rig.arms {
            let mut pose = ArmPose::from_rotations(arm, local);
            if self.limits {
                limit(&mut pose, counter);
            }
            if self.curl_coherence {
                limit_curl_spread(&mut pose, counter);
            }
            pose.write(arm, local);
        }
    }
}

/// Kinds of clamps, with the number of such angles in both arms.
const KINDS: [(&str, usize); 14] = [
    ("elbow flexion", 2),
    ("elbow side bend", 2),
    ("forearm rotation", 2),
    ("wrist flexion", 2),
    ("wrist deviation", 2),
    ("knuckle flexion", 8),
    ("knuckle spread", 8),
    ("middle joint flexion", 8),
    ("middle joint side bend", 8),
    ("end joint flexion", 8),
    ("end joint side bend", 8),
    ("thumb flexion", 6),
    ("thumb side bend", 6),
    ("curl coherence", 24),
];
const ELBOW: usize = 0;
const TURN: usize = 2;
const WRIST: usize = 3;
const FINGER: usize = 5;
const THUMB: usize = 11;
const COHERENCE: usize = 13;
/// Minimum change that counts as a clamp, degrees; smaller ones are rounding errors.
const MIN_CLAMP_DEGREES: f64 = 1e-6;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Clamps {
    pub kind: &'static str,
    /// Number of clamped angles, and the fraction of all angles of this kind.
    pub joint_frames: usize,
    pub share: f64,
    /// Mean and maximum amount by which the clamped angles exceeded their limit.
    pub mean_excess_degrees: f64,
    pub largest_excess_degrees: f64,
}

#[derive(Clone, Debug, Default)]
pub struct ClampCounter {
    n_frames: usize,
    /// Count, sum and maximum of the excess (degrees), by kind.
    kinds: [(usize, f64, f64); KINDS.len()],
}

impl ClampCounter {
    fn changed(&mut self, kind: usize, from: f64, to: f64) -> f64 {
        let excess = turn(from - to).abs();
        if excess > MIN_CLAMP_DEGREES {
            let (n, sum, largest) = &mut self.kinds[kind];
            *n += 1;
            *sum += excess;
            *largest = largest.max(excess);
        }
        to
    }

    /// Share of the angles of fingers and thumbs that exceeded their limits.
    pub fn finger_share(&self) -> f64 {
        let n: usize = self.kinds[FINGER..COHERENCE].iter().map(|(n, ..)| n).sum();
        let n_angles: usize = KINDS[FINGER..COHERENCE].iter().map(|(_, n)| n).sum();
        n as f64 / (n_angles * self.n_frames).max(1) as f64
    }

    /// Statistics of every kind, including those without clamps.
    pub fn clamps(&self) -> Vec<Clamps> {
        let kinds = KINDS.into_iter().zip(self.kinds);
        kinds
            .map(|((kind, n_angles), (joint_frames, sum, largest_excess_degrees))| Clamps {
                kind,
                joint_frames,
                share: joint_frames as f64 / (n_angles * self.n_frames).max(1) as f64,
                mean_excess_degrees: sum / joint_frames.max(1) as f64,
                largest_excess_degrees,
            })
            .collect()
    }
}

fn limit(pose: &mut ArmPose, counter: &mut ClampCounter) {
    pose.elbow = bend(pose.elbow, limits::ELBOW, ELBOW, counter);
    // An angle tracked beyond half a turn still exceeds the same limit.
    let [pronated, supinated] = limits::SUPINATION;
    let turned = pose.supination.clamp(pronated, supinated);
    // For a hand bent sideways across the forearm, forearm rotation and wrist flexion cannot be distinguished.
    let turned = turned * certainty(pose.wrist.side);
    pose.supination = counter.changed(TURN, pose.supination, turned);
    pose.wrist = bend(pose.wrist, limits::WRIST, WRIST, counter);
    for (finger, limits) in limits::FINGERS.iter().enumerate() {
        for (k, &limit) in limits.iter().enumerate() {
            let kind = if finger == 0 { THUMB } else { FINGER + 2 * k };
            pose.fingers[finger][k] = bend(pose.fingers[finger][k], limit, kind, counter);
        }
    }
}

/// Clamps a bend to its limits; `kind` counts the flexion, `kind + 1` the side.
fn bend(given: Bend, limit: Limit, kind: usize, counter: &mut ClampCounter) -> Bend {
    let middle = (limit.flexion[0] + limit.flexion[1]) / 2.0;
    let flexion = middle + certainty(given.side) * (clamp_circular(limit.flexion, given.flexion) - middle);
    Bend {
        flexion: counter.changed(kind, given.flexion, flexion),
        side: counter.changed(kind + 1, given.side, given.side.clamp(limit.side[0], limit.side[1])),
    }
}

/// Certainty of a flexion: 1, falling from a sideways bend of 70 degrees, the widest limit, to 0 at 90.
fn certainty(side: f64) -> f64 {
    1.0 - smoothstep([70.0, 90.0], side.abs())
}

/// Clamps the four fingers' flexion, level by level, to a range around their mean. The mean is that of the result, so a
/// second application changes nothing.
fn limit_curl_spread(pose: &mut ArmPose, counter: &mut ClampCounter) {
    for k in 0..3 {
        let given = [1, 2, 3, 4].map(|finger: usize| pose.fingers[finger][k].flexion);
        let mean = coherent_mean(given);
        for (finger, flexion) in (1..).zip(given) {
            let to = flexion.clamp(mean - CURL_COHERENCE, mean + CURL_COHERENCE);
            pose.fingers[finger][k].flexion = counter.changed(COHERENCE, flexion, to);
        }
    }
}

/// Mean of four angles that is also the mean after clamping around it; of several, the one nearest to the plain mean.
/// `rise(m)`, the mean of the clamped angles minus m, decreases with m; its root is bisected from the plain mean.
fn coherent_mean(given: [f64; 4]) -> f64 {
    let rise = |m: f64| given.iter().map(|f| (f - m).clamp(-CURL_COHERENCE, CURL_COHERENCE)).sum::<f64>() / 4.0;
    let mean = given.iter().sum::<f64>() / 4.0;
    let sign = rise(mean);
    if sign.abs() < 1e-12 {
        return mean;
    }
    let reach = given.iter().fold(0.0f64, |reach, f| reach.max((f - mean).abs()));
    let (mut near, mut far) = (mean, mean + reach.copysign(sign));
    for _ in 0..60 {
        let middle = (near + far) / 2.0;
        if rise(middle) * sign > 1e-12 { near = middle } else { far = middle }
    }
    (near + far) / 2.0
}
