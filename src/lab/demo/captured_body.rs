//! Captured motion on a body of this program: the directions of arms and fingers and the rotations of trunk and head
//! are those of the capture, all bone lengths those of the body. Both shoulders move with the line between them; legs
//! are generated, and so are hands that the capture lacks.

use super::people::body::{self, Build, SIDES};
use super::people::scene::CapturedClip;
use super::people::vocabulary::Arms;
use crate::mocap::captured::take::{CapturedFrame, CapturedTake, oriented};
use orator_avatar::animate::performance::perform_on;
use orator_avatar::animate::rig::rig::Rig;
use orator_avatar::animate::{AnimationOptions, Constraints, Performance};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use orator_base::types::pose3d::Motion;

/// World rotations of a person's trunk and head; the identity is upright and faces ahead.
#[derive(Clone, Copy, Debug)]
pub struct TrunkRotations {
    /// `None`: the hips are generated.
    pub hips: Option<Rotation>,
    /// The y axis points along the trunk; the x axis is the shoulder line, as far as it is perpendicular.
    pub chest: Rotation,
    pub head: Rotation,
}

impl TrunkRotations {
    fn of_frame(frame: &CapturedFrame) -> Self {
        Self {
            hips: frame.hips.map(|line| oriented(line, frame.spine)),
            chest: oriented(frame.shoulder_line(), frame.spine),
            head: frame.head,
        }
    }

    /// Rotations at a time in frames, interpolated; `None` if there are none.
    pub fn at(frames: &[Self], time: f64) -> Option<Self> {
        let last = frames.len().checked_sub(1)?;
        let before = (time.max(0.0) as usize).min(last);
        let (from, to) = (frames[before], frames[(before + 1).min(last)]);
        let share = (time - before as f64).clamp(0.0, 1.0);
        Some(Self {
            hips: from.hips.zip(to.hips).map(|(from, to)| from.slerp(to, share)),
            chest: from.chest.slerp(to.chest, share),
            head: from.head.slerp(to.head, share),
        })
    }

    /// Replaces the rotations of trunk and head in a frame of a rig. Arms and legs keep their world rotations; `chest`
    /// is the world rotation of the chest that the arms' rotations refer to.
    pub fn apply(&self, rig: &Rig, chest: Rotation, local: &mut [Rotation]) {
        let hips = self.hips.unwrap_or(local[0]);
        for [upper, ..] in rig.legs {
            local[upper] = hips.inverse() * local[0] * local[upper];
        }
        for arm in &rig.arms {
            local[arm.clavicle] = self.chest.inverse() * chest * local[arm.clavicle];
        }
        let spine = hips.slerp(self.chest, 0.5);
        let neck = self.chest.slerp(self.head, 0.5);
        local[0] = hips;
        local[rig.spine] = hips.inverse() * spine;
        local[rig.chest] = spine.inverse() * self.chest;
        local[rig.neck] = self.chest.inverse() * neck;
        local[rig.head] = neck.inverse() * self.head;
    }
}

/// Clip of a take for a body of the seed's own proportions, without sound.
pub fn clip(take: &CapturedTake) -> CapturedClip {
    let trunk = take.frames.iter().map(TrunkRotations::of_frame).collect();
    CapturedClip { motion: take.motion(), sound: None, trunk }
}

/// The motion on the rig of `build`, without filters and limits, which would change directions. `arms`: generated
/// postures of the left and right arm at a time in seconds, whose hands replace missing ones.
pub fn perform(motion: &Motion, build: &Build, options: &AnimationOptions, arms: impl Fn(f64) -> Arms) -> Performance {
    let mut joints = motion.joints.clone();
    for (t, mut frame) in joints.outer_iter_mut().enumerate() {
        let postures = arms(motion.fps.secs(t));
        for ((shoulder, root, sign), posture) in SIDES.into_iter().zip(&postures) {
            // Without the base of the index finger the hand has no orientation.
            if frame[[root + 5, 0]].is_finite() {
                continue;
            }
            let [elbow, wrist]: [Vec3; 2] =
                [shoulder + 1, shoulder + 2].map(|joint| std::array::from_fn(|k| f64::from(frame[[joint, k]])));
            let hand = body::hand_joints(build, posture, elbow, wrist, sign);
            for (point, at) in hand.into_iter().enumerate() {
                (0..3).for_each(|k| frame[[root + point, k]] = at[k] as f32);
            }
        }
    }
    let options = AnimationOptions { constraints: Constraints::NONE, ..*options };
    perform_on(build.rig(), &Motion::from_joints(motion.fps, joints), None, &options)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::people::condition::Condition;
    use crate::demo::people::scene::{ClipSeeds, PersonScene};
    use orator_base::math::vec3::{dot, sub, unit};
    use orator_base::types::skeleton::{
        ARM_BONES, L_HAND, L_SHOULDER, N_HAND_JOINTS, N_JOINTS, NECK, R_HAND, R_SHOULDER, is_duplicate, parent,
    };
    use orator_base::types::time::FrameRate;

    /// A talk of 2 s: raised, straight and bent arms, a trunk that leans and turns, shoulders that tilt.
    fn take(with_fingers: bool) -> CapturedTake {
        let frame = |t: usize| {
            let wave = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * t as f64 / 30.0 + phase).sin();
            let trunk = Rotation::about([0.0, 1.0, 0.0], 0.5 * wave(0.4, 0.0))
                * Rotation::about([1.0, 0.0, 0.0], 0.25 + 0.2 * wave(0.3, 1.0));
            let tilt = trunk * Rotation::about([0.0, 0.0, 1.0], 0.15 * wave(0.5, 2.0));
            let bone = |sign: f64, lift: f64, ahead: f64, metres: f64| {
                let direction = unit([sign * 0.6, lift, ahead], 0.0).unwrap();
                tilt.turn(direction).map(|v| metres * v)
            };
            let add = |a: Vec3, b: Vec3| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
            let top = trunk.turn([0.0, 0.5, 0.0]);
            let arm = |sign: f64| {
                let shoulder = add(top, tilt.turn([sign * 0.12, 0.0, 0.0]));
                let elbow = add(shoulder, bone(sign, 1.5 * wave(0.7, sign), 0.2, 0.33));
                [shoulder, elbow, add(elbow, bone(sign * wave(0.6, 0.5), wave(0.9, 1.0), 0.9, 0.21))]
            };
            let [right, left] = [arm(-1.0), arm(1.0)];
            let arms = [right[0], right[1], right[2], left[0], left[1], left[2]];
            let head = Rotation::about([0.0, 1.0, 0.0], wave(0.8, 0.0));
            let mut frame = CapturedFrame::new(arms, [0.0; 3], Some(trunk.turn([0.2, 0.0, 0.0])), head);
            if with_fingers {
                for (root, sign) in [(L_HAND, 1.0), (R_HAND, -1.0)] {
                    for point in 1..N_HAND_JOINTS {
                        let (finger, bone) = ((point - 1) / 4, (point - 1) % 4);
                        let across = sign * (0.03 - 0.015 * finger as f64);
                        let curl = 0.4 * bone as f64 * (1.0 + wave(1.1, finger as f64));
                        let place = [0.07 + 0.03 * bone as f64 * curl.cos(), across, -0.02 * curl.sin()];
                        frame.joints[root + point] = add(frame.joints[root], tilt.turn(place));
                    }
                }
            }
            frame
        };
        CapturedTake { name: "talk".to_owned(), fps: FrameRate::new(30, 1), frames: (0..60).map(frame).collect() }
    }

    fn degrees(a: Vec3, b: Vec3) -> f64 {
        let [a, b] = [a, b].map(|v| unit(v, 1e-9).unwrap());
        dot(a, b).clamp(-1.0, 1.0).acos().to_degrees()
    }

    #[test]
    fn every_body_has_the_directions_of_the_capture_and_its_own_bones() {
        for with_fingers in [true, false] {
            let take = take(with_fingers);
            for body in 1..4 {
                let seeds = ClipSeeds { body, clothes: 1, camera: 1, motion: 1, voice: None };
                let fps = FrameRate::new(15, 1);
                let scene = PersonScene::new(Condition::Front, seeds, 2.0, fps, Some(&clip(&take)));
                let actor = &scene.actors[0];
                let facing = Rotation::about([0.0, 1.0, 0.0], -actor.role.turn);
                for (t, pose) in actor.poses.iter().enumerate() {
                    let captured = &take.frames[2 * t];
                    let positions = actor.rig.skeleton.positions(pose.root, &pose.local);
                    let bone = |from: usize, to: usize| {
                        let [from, to] = [from, to].map(|joint| positions[actor.rig.positions[joint]]);
                        facing.turn(sub(to, from))
                    };
                    let error = |a: usize, b: usize| degrees(bone(a, b), sub(captured.joints[b], captured.joints[a]));
                    for (a, b) in ARM_BONES.into_iter().chain([(R_SHOULDER, L_SHOULDER)]) {
                        assert!(error(a, b) < 1.0, "body {body}, frame {t}, bone {a} to {b}: {}", error(a, b));
                    }
                    let fingers = (L_HAND + 1..N_JOINTS).filter(|&joint| !is_duplicate(joint));
                    for joint in fingers.filter(|joint| with_fingers && !((joint - L_HAND - 1) % 21).is_multiple_of(4))
                    {
                        let error = error(parent(joint).unwrap(), joint);
                        assert!(error < 1.0, "body {body}, frame {t}, finger joint {joint}: {error}");
                    }
                    let trunk = sub(positions[actor.rig.positions[NECK]], positions[0]);
                    assert!(degrees(facing.turn(trunk), captured.spine) < 1.0);
                    let head = facing * actor.rig.skeleton.world(&pose.local)[actor.rig.head];
                    assert!((head.inverse() * captured.head).angle() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn trunk_rotations_are_interpolated_and_held_at_the_end() {
        let rotation = |angle: f64| Rotation::about([0.0, 1.0, 0.0], angle);
        let of = |angle: f64| TrunkRotations { hips: None, chest: rotation(angle), head: rotation(2.0 * angle) };
        let frames = [of(0.0), of(0.4)];
        let at = |time: f64| TrunkRotations::at(&frames, time).unwrap();
        assert!((at(0.5).chest.angle() - 0.2).abs() < 1e-9 && (at(0.5).head.angle() - 0.4).abs() < 1e-9);
        assert!((at(7.0).chest.angle() - 0.4).abs() < 1e-9 && at(7.0).hips.is_none());
        assert!(TrunkRotations::at(&[], 0.0).is_none());
    }
}
