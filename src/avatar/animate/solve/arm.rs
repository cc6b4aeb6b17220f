//! Joint positions to bone rotations. The shoulders' yaw is shared equally by spine and chest, and each arm is solved
//! as a left arm from shoulder to finger tips. Bones take their smoothed directions; the roll of the upper arm aligns
//! the elbow axis with the normal of the arm's plane and is interpolated where the arm is straight; the hand's frame is
//! computed from its knuckles, and half of its twist is given to the forearm. Fingers bend without twist.

use super::arm_pose::{ArmPose, elbow};
use super::positions::JointPositions;
use super::reach::reach;
use super::roll::upper_arm_rotations;
use super::smoothing::{Filter, Smoothing};
use super::track::{ObservedTrack, RotationTrack, filled, mirrored, world};
use crate::animate::rig::hinge::Bend;
use crate::animate::rig::rig::{CM, Rig, RigArm, finger_hinge};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, norm};
use orator_base::types::skeleton::{L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, NECK};
use orator_base::types::time::FrameRate;

const X: Vec3 = [1.0, 0.0, 0.0];
/// Time in which a missing hand relaxes, seconds.
const RELAX_SECS: f64 = 0.5;
/// Flexion of the joints of a relaxed hand, degrees, thumb first.
const RELAXED_DEGREES: [[f64; 3]; 5] =
    [[8.0, 10.0, 10.0], [20.0, 26.0, 16.0], [20.0, 26.0, 16.0], [20.0, 26.0, 16.0], [20.0, 26.0, 16.0]];
/// Degrees beyond half a turn from the centre of its range up to which the rotation of a hand is tracked before it
/// counts as a rotation the other way.
const MAX_TRACKED_DEGREES: f64 = 60.0;

/// Frame rate and the filters for it.
pub struct SolveFilters {
    pub fps: f64,
    pub arms: Filter,
    pub hands: Filter,
    pub fingers: Filter,
}

impl SolveFilters {
    pub fn new(smoothing: Smoothing, fps: FrameRate) -> Self {
        let (arms, hands, fingers) = (smoothing.arms(fps), smoothing.hands(fps), smoothing.fingers(fps));
        Self { fps: fps.per_sec(), arms, hands, fingers }
    }
}

type Directions = Vec<Option<Vec3>>;

/// Local rotations, by joint of the rig. Hips, neck, head and legs keep their rest rotation.
pub fn rotations(positions: &JointPositions, rig: &Rig, filters: &SolveFilters) -> Vec<RotationTrack> {
    let n_frames = positions.n_frames();
    let mut local: Vec<RotationTrack> = vec![vec![Rotation::IDENTITY; n_frames]; rig.skeleton.joints.len()];

    let mut line: Vec<Option<Vec3>> = (0..n_frames).map(|t| positions.shoulder_line(t)).collect();
    filters.arms.directions(&mut line, &[]);
    let half_yaw = |[x, _, z]: Vec3| Rotation::about([0.0, 1.0, 0.0], (-z).atan2(x) / 2.0);
    let half_yaw = filled(line.into_iter().map(|line| line.map(half_yaw)).collect(), Rotation::IDENTITY, None);
    let chest: RotationTrack = half_yaw.iter().map(|&half| half * half).collect();
    local[rig.spine].clone_from(&half_yaw);
    local[rig.chest] = half_yaw;

    let [left, right] = &rig.arms;
    let metres =
        |arm: &RigArm| [arm.upper, arm.forearm, arm.hand].map(|joint| norm(rig.skeleton.joints[joint].offset) / CM);
    solve(positions, (left, metres(left)), &chest, filters, &mut local);
    solve(&positions.mirrored(), (right, metres(right)), &mirrored(chest), filters, &mut local);
    let fingers = right.fingers.iter().flatten();
    for &joint in [right.clavicle, right.upper, right.forearm, right.hand].iter().chain(fingers) {
        local[joint] = mirrored(std::mem::take(&mut local[joint]));
    }
    local
}

/// Solves `arm` as a left arm (right arms are given mirrored) and writes its tracks into `local`, one track per joint
/// of the skeleton. `metres`: lengths of clavicle, upper arm and forearm.
fn solve(
    positions: &JointPositions,
    (arm, metres): (&RigArm, [f64; 3]),
    chest: &RotationTrack,
    filters: &SolveFilters,
    local: &mut [RotationTrack],
) {
    let n_frames = positions.n_frames();
    let relax_frames = Some(RELAX_SECS * filters.fps);
    let smooth = |parent: &RotationTrack, from: usize, to: usize| -> Directions {
        let local_direction = |t: usize| Some(parent[t].inverse().turn(positions.direction(t, from, to)?));
        let mut track: Directions = (0..n_frames).map(local_direction).collect();
        filters.arms.directions(&mut track, &[]);
        track
    };
    let clavicle = smooth(chest, NECK, L_SHOULDER).into_iter().map(|to| Some(Rotation::between(X, to?)));
    local[arm.clavicle] = filled(clavicle.collect(), Rotation::IDENTITY, None);
    let clavicle = world(chest, &local[arm.clavicle]);

    let (mut along, mut fore) = (smooth(&clavicle, L_SHOULDER, L_ELBOW), smooth(&clavicle, L_ELBOW, L_WRIST));
    reach(positions, metres, (chest, &clavicle), &filters.arms, (&mut along, &mut fore));
    let upper: ObservedTrack = upper_arm_rotations(&along, &fore);
    let hanging = Rotation::between(X, [0.17, -0.985, 0.0]);
    local[arm.upper] = filled(upper, hanging, None);
    let bent = |(upper, fore): (&Rotation, &Option<Vec3>)| {
        Some(elbow().rotation(elbow().bend(upper.inverse().turn((*fore)?))))
    };
    let bent: ObservedTrack = local[arm.upper].iter().zip(&fore).map(bent).collect();
    let relaxed_elbow = elbow().rotation(Bend { flexion: 17.0, side: 0.0 });
    let fore = filled(bent, relaxed_elbow, None);
    let forearm = world(&world(&clavicle, &local[arm.upper]), &fore);

    let frames: ObservedTrack = (0..n_frames).map(|t| positions.hand_frame(t)).collect();
    let hand = filled(
        smooth_hand(&forearm, &frames, &filters.hands, positions.hand_error()),
        Rotation::IDENTITY,
        relax_frames,
    );
    let mut previous = 0.0;
    for t in 0..n_frames {
        let (supination, wrist) = ArmPose::hand_angles(hand[t], previous, MAX_TRACKED_DEGREES);
        previous = supination;
        (local[arm.forearm][t], local[arm.hand][t]) = ArmPose::shared(fore[t], supination, wrist);
    }
    for (finger, joints) in arm.fingers.iter().enumerate() {
        let bones = solve_finger(positions, &frames, finger, &filters.fingers);
        for ((&joint, bone), relaxed) in joints.iter().zip(bones).zip(RELAXED_DEGREES[finger]) {
            let rest = finger_hinge(finger).rotation(Bend { flexion: relaxed, side: 0.0 });
            local[joint] = filled(bone, rest, relax_frames);
        }
    }
}

/// Hand rotations relative to the untwisted forearm, smoothed as three angles. These are unique within the limits,
/// while smoothed directions would cancel out between palm up and palm down.
fn smooth_hand(forearm: &RotationTrack, frames: &ObservedTrack, filter: &Filter, error: &[f64]) -> ObservedTrack {
    let mut previous = 0.0;
    let mut angle = |(hand, fore): (&Option<Rotation>, &Rotation)| {
        let (supination, wrist) = ArmPose::hand_angles(fore.inverse() * (*hand)?, previous, MAX_TRACKED_DEGREES);
        previous = supination;
        Some([supination, wrist.flexion, wrist.side].map(f64::to_radians))
    };
    let mut angles: Vec<Option<Vec3>> = frames.iter().zip(forearm).map(&mut angle).collect();
    filter.runs(&mut angles, error);
    let rotation = |angles: Vec3| {
        let [supination, flexion, side] = angles.map(f64::to_degrees);
        ArmPose::hand(supination, Bend { flexion, side })
    };
    angles.into_iter().map(|angles| angles.map(rotation)).collect()
}

/// Rotations of a finger's joints. Bones are smoothed in the observed hand's axes, which removes the hand's noise.
fn solve_finger(
    positions: &JointPositions,
    frames: &ObservedTrack,
    finger: usize,
    filter: &Filter,
) -> [ObservedTrack; 3] {
    let (hinge, base) = (finger_hinge(finger), L_HAND + 1 + 4 * finger);
    let mut parent: ObservedTrack = vec![Some(Rotation::IDENTITY); frames.len()];
    [0, 1, 2].map(|k| {
        let local_direction =
            |t: usize| Some(frames[t]?.inverse().turn(positions.direction(t, base + k, base + k + 1)?));
        let mut track: Directions = (0..frames.len()).map(local_direction).collect();
        filter.directions(&mut track, positions.hand_error());
        let bone = |(parent, to): (&Option<Rotation>, Option<Vec3>)| {
            Some(hinge.rotation(hinge.bend((*parent)?.inverse().turn(to?))))
        };
        let bones: ObservedTrack = parent.iter().zip(track).map(bone).collect();
        parent = parent.iter().zip(&bones).map(|(parent, bone)| Some((*parent)? * (*bone)?)).collect();
        bones
    })
}
