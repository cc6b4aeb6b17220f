//! Joints to bone rotations, by swing and twist, mirror-symmetric. The turn of the shoulders about the vertical goes
//! half to the spine and half to the chest; the clavicle swings. The upper arm's roll is that of the elbow plane, and
//! is held where the arm is straight; the hand's frame comes from its knuckles, and half of its twist against the
//! forearm is given to the forearm. Fingers swing. A gap between seen frames is bridged, before and after them the
//! nearest is held; a hand relaxes in a long gap. Forward kinematics gives the joints back wherever bones keep their
//! length.

use super::figure::{Arm, Figure, rest_direction};
use crate::motion::rotation::Rotation;
use crate::motion::vec3::{Vec3, across, add, cross, dot, scale, sub, unit};
use crate::types::pose3d::Motion;
use crate::types::skeleton::{L_SHOULDER, N_JOINTS, NECK, R_SHOULDER};

/// Shorter than this, metres, a bone has no direction.
const LEAST_METRES: f64 = 1e-5;
/// Elbow angles (0: straight) between which the roll passes from held to measured.
const STRAIGHT_DEGREES: [f64; 2] = [8.0, 20.0];
/// Middle of the hand's range of twist against the upper arm, degrees of supination from palm down.
const MIDDLE_TWIST_DEGREES: f64 = 80.0;
/// A missing hand is relaxed after this time.
const RELAX_SECS: f64 = 0.5;

/// Rotations of one joint over time.
type Track = Vec<Rotation>;
/// The same where not every frame tells.
type Seen = Vec<Option<Rotation>>;

/// Local rotations of the figure's joints, frame by frame, in the figure's axes (x, -y, -z of the motion's).
pub fn rotations(motion: &Motion, figure: &Figure) -> Vec<Vec<Rotation>> {
    let n_frames = motion.n_frames();
    let places = Places::of(motion);
    let relax_frames = RELAX_SECS * motion.fps.per_sec();
    let mut local: Vec<Track> = vec![vec![Rotation::IDENTITY; n_frames]; figure.skeleton.joints.len()];

    let half_yaw: Seen = (0..n_frames).map(|t| places.half_yaw(t)).collect();
    let half_yaw = filled(half_yaw, Rotation::IDENTITY, None);
    let chest: Track = half_yaw.iter().map(|&half| half * half).collect();
    local[figure.spine].clone_from(&half_yaw);
    local[figure.chest] = half_yaw;
    for arm in &figure.arms {
        let hand = solve_arm(&places, arm, &chest, relax_frames, &mut local);
        solve_fingers(&places, arm, &hand, relax_frames, &mut local);
    }
    (0..n_frames).map(|t| local.iter().map(|track| track[t]).collect()).collect()
}

/// Clavicle, upper arm, forearm and hand; gives the hand's world rotations.
fn solve_arm(places: &Places, arm: &Arm, chest: &Track, relax_frames: f64, local: &mut [Track]) -> Track {
    let n_frames = chest.len();
    let (along, hinge) = (arm.along(), [0.0, -arm.sign, 0.0]);
    let bone = |t: usize, joint: usize, from: usize| places.direction(t, from, joint);
    let swing = |parent: Rotation, direction: Vec3| Rotation::between(along, parent.inverse().turn(direction));

    let clavicle: Seen = (0..n_frames).map(|t| Some(swing(chest[t], bone(t, arm.shoulder, NECK)?))).collect();
    local[arm.clavicle] = filled(clavicle, Rotation::IDENTITY, None);
    let clavicle = world(chest, &local[arm.clavicle]);

    let mut held = (along, hinge);
    let upper: Seen = (0..n_frames)
        .map(|t| {
            let parent = clavicle[t].inverse();
            let upper = parent.turn(bone(t, arm.shoulder + 1, arm.shoulder)?);
            let fore = bone(t, arm.shoulder + 2, arm.shoulder + 1).map(|fore| parent.turn(fore));
            held = (upper, elbow_axis(held, upper, fore));
            Some(Rotation::between_frames((along, hinge), held))
        })
        .collect();
    let hanging = Rotation::between(along, [arm.sign * 0.17, -0.985, 0.0]);
    local[arm.upper] = filled(upper, hanging, None);
    let upper = world(&clavicle, &local[arm.upper]);

    let fore: Seen =
        (0..n_frames).map(|t| Some(swing(upper[t], bone(t, arm.shoulder + 2, arm.shoulder + 1)?))).collect();
    let bent = Rotation::about(hinge, 0.3);
    let fore = filled(fore, bent, None);
    let untwisted = world(&upper, &fore);

    let hand: Seen = (0..n_frames).map(|t| Some(untwisted[t].inverse() * places.hand_frame(t, arm)?)).collect();
    let neutral = Rotation::about(along, -arm.sign * MIDDLE_TWIST_DEGREES.to_radians());
    let hand = filled(hand, neutral, Some(relax_frames));
    for t in 0..n_frames {
        let half = Rotation::about(along, supination(hand[t], arm) / 2.0);
        local[arm.fore][t] = fore[t] * half;
        local[arm.hand][t] = half.inverse() * hand[t];
    }
    world(&untwisted, &hand)
}

/// The axis the elbow bends about, across the upper arm: measured where the arm is bent, else `held` (direction and
/// axis of the frame before) carried along.
fn elbow_axis(held: (Vec3, Vec3), upper: Vec3, fore: Option<Vec3>) -> Vec3 {
    let carried = across(Rotation::between(held.0, upper).turn(held.1), upper);
    let carried = unit(carried, 1e-9).unwrap_or(held.1);
    let measured = fore.and_then(|fore| {
        let degrees = dot(upper, fore).clamp(-1.0, 1.0).acos().to_degrees();
        Some((unit(cross(upper, fore), 1e-9)?, smoothstep(STRAIGHT_DEGREES, degrees)))
    });
    let Some((axis, weight)) = measured else { return carried };
    let mixed = add(scale(carried, 1.0 - weight), scale(axis, weight));
    unit(across(mixed, upper), 1e-3).unwrap_or(if weight > 0.5 { axis } else { carried })
}

/// Angle of a hand's twist about the arm, taken within half a turn of the middle of its range.
fn supination(hand: Rotation, arm: &Arm) -> f64 {
    let (_, twist) = hand.swing_twist(arm.along());
    let middle = -arm.sign * MIDDLE_TWIST_DEGREES.to_radians();
    middle + (twist - middle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI
}

fn solve_fingers(places: &Places, arm: &Arm, hand: &Track, relax_frames: f64, local: &mut [Track]) {
    let curl = cross(arm.along(), [0.0, -1.0, 0.0]);
    for (finger, joints) in arm.fingers.iter().enumerate() {
        let base = arm.hand_root + 1 + 4 * finger;
        let mut parent = hand.clone();
        for (k, &joint) in joints.iter().enumerate() {
            let rest = rest_direction(finger, k, arm.sign);
            let from = if k == 0 { arm.hand_root } else { base + k - 1 };
            let seen: Seen = (0..parent.len())
                .map(|t| {
                    let direction = places.direction(t, from, base + k)?;
                    Some(Rotation::between(rest, parent[t].inverse().turn(direction)))
                })
                .collect();
            let degrees: f64 = if finger == 0 { [0.0, 8.0, 10.0, 10.0][k] } else { [0.0, 20.0, 26.0, 16.0][k] };
            local[joint] = filled(seen, Rotation::about(curl, degrees.to_radians()), Some(relax_frames));
            parent = world(&parent, &local[joint]);
        }
    }
}

/// Joints in the figure's axes, metres.
struct Places(Vec<[Option<Vec3>; N_JOINTS]>);

impl Places {
    fn of(motion: &Motion) -> Self {
        let place = |frame: &ndarray::ArrayView2<f32>, joint: usize| {
            let place = [0, 1, 2].map(|k| f64::from(frame[[joint, k]]) * if k == 0 { 1.0 } else { -1.0 });
            place.iter().all(|v| v.is_finite()).then_some(place)
        };
        Self(motion.joints.outer_iter().map(|frame| std::array::from_fn(|joint| place(&frame, joint))).collect())
    }

    fn direction(&self, t: usize, from: usize, to: usize) -> Option<Vec3> {
        unit(sub(self.0[t][to]?, self.0[t][from]?), LEAST_METRES)
    }

    /// Half of the shoulder line's turn about the vertical.
    fn half_yaw(&self, t: usize) -> Option<Rotation> {
        let [x, _, z] = sub(self.0[t][L_SHOULDER]?, self.0[t][R_SHOULDER]?);
        (x.hypot(z) > LEAST_METRES).then(|| Rotation::about([0.0, 1.0, 0.0], (-z).atan2(x) / 2.0))
    }

    /// World rotation of a hand: along from the wrist to the middle of its knuckles, across from the index finger's
    /// base to the little finger's.
    fn hand_frame(&self, t: usize, arm: &Arm) -> Option<Rotation> {
        let knuckles = [1, 2, 3, 4].map(|finger| self.0[t][arm.hand_root + 1 + 4 * finger]);
        let [index, .., little] = knuckles;
        let seen: Vec<Vec3> = knuckles.into_iter().flatten().collect();
        let middle = scale(seen.iter().copied().fold([0.0; 3], add), 1.0 / seen.len().max(1) as f64);
        let along = unit(sub(middle, self.0[t][arm.hand_root]?), LEAST_METRES)?;
        let side = unit(across(sub(little?, index?), along), LEAST_METRES)?;
        Some(Rotation::between_frames((arm.along(), [0.0, 0.0, -1.0]), (along, side)))
    }
}

fn world(parent: &Track, local: &Track) -> Track {
    parent.iter().zip(local).map(|(&parent, &local)| parent * local).collect()
}

/// A track without gaps: bridged the shortest way between seen frames, held outside them, `rest` if nothing is seen.
/// With `relax_frames` it moves to `rest` within that many frames of the nearest seen one.
fn filled(seen: Seen, rest: Rotation, relax_frames: Option<f64>) -> Track {
    let known: Vec<(usize, Rotation)> = seen.iter().enumerate().filter_map(|(t, r)| Some((t, (*r)?))).collect();
    (0..seen.len())
        .map(|t| {
            let after = known.partition_point(|&(at, _)| at < t);
            let next = known.get(after).copied();
            let previous = after.checked_sub(1).and_then(|before| known.get(before)).copied();
            let (bridge, distance) = match (previous, next) {
                (_, Some((at, rotation))) if at == t => return rotation,
                (None, None) => return rest,
                (Some((at, rotation)), None) => (rotation, t - at),
                (None, Some((at, rotation))) => (rotation, at - t),
                (Some((from, a)), Some((to, b))) => {
                    (a.slerp(b, (t - from) as f64 / (to - from) as f64), (t - from).min(to - t))
                }
            };
            match relax_frames {
                Some(frames) => bridge.slerp(rest, smoothstep([0.0, frames], distance as f64)),
                None => bridge,
            }
        })
        .collect()
}

/// 0 below `low`, 1 above `high`, smooth between.
fn smoothstep([low, high]: [f64; 2], at: f64) -> f64 {
    let share = ((at - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
