//! Procedural hand motion for captured bodies without hands: smooth transitions between random hand poses (bends
//! within anatomical limits, fingers mostly together), attached to the forearm within the wrist's range of motion.

use super::hand_shape::normal;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::hand_bones::{BONES, FAN, METRES, direction, put_finger};
use orator_base::motion::view::hand::HandJoints;
use orator_base::types::pose2d::N_HAND;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Number of parameters of a pose.
const N: usize = 15;

/// Pose parameters: curl (0 straight, 1 a fist), increase of the curl from finger to finger, each finger's own curl,
/// spread, extra bend of first and second joints (degrees), thumb abduction, opposition and bend (radians), wrist
/// flexion to the palm, deviation to the thumb, and pronation (radians).
#[derive(Clone, Copy, Debug, PartialEq)]
struct HandPose([f64; N]);

impl HandPose {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        let curl = rng.random_range(-0.1f64..0.9).max(0.0).powf(1.5);
        let own = if rng.random_bool(0.3) { 0.4 } else { 0.06 };
        let finger = [0; 4].map(|_| own * normal(rng));
        Self([
            curl,
            0.04 + 0.06 * normal(rng),
            finger[0],
            finger[1],
            finger[2],
            finger[3],
            rng.random_range(-0.2..1.1),
            12.0 * normal(rng),
            10.0 * normal(rng),
            (0.6 + 0.3 * normal(rng)).clamp(-0.3, 1.4),
            (0.45 + 0.3 * normal(rng)).clamp(-0.3, 1.3),
            (0.35 + 0.3 * normal(rng)).clamp(-0.3, 1.1),
            (0.35 * normal(rng) - 0.15).clamp(-1.0, 1.0),
            (0.15 * normal(rng)).clamp(-0.4, 0.4),
            (0.5 + 0.6 * normal(rng)).clamp(-1.2, 1.5),
        ])
    }

    /// Linear interpolation to another pose; `along` 0..1.
    fn towards(&self, other: &Self, along: f64) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + along * (other.0[k] - self.0[k])))
    }

    /// A right hand, metres, the wrist at 0, upright: fingers along -y, thumb towards +x, the palm facing -z.
    fn hand(&self, size: f64) -> HandJoints {
        let p = &self.0;
        let mut hand: HandJoints = [[0.0; 3]; N_HAND];
        for finger in 0..5 {
            let fan = FAN[finger].to_radians();
            let (first, aside, bends) = if finger == 0 {
                (direction(fan, 0.28), p[9], [p[10], p[11], p[11]])
            } else {
                let curl = (p[0] + p[1] * (finger as f64 - 2.5) + p[1 + finger]).clamp(-0.12, 1.1);
                let aside = fan * (0.3 + 0.7 * p[6] * (1.0 - 0.6 * curl.max(0.0)));
                let first = (80.0 * curl + p[7]).clamp(-25.0, 92.0);
                let second = (100.0 * curl + p[8] + 8.0).clamp(-5.0, 108.0);
                (direction(fan, 0.0), aside, [first, second, 0.55 * second].map(f64::to_radians))
            };
            let lengths = BONES[finger].map(|mm| size * METRES * mm);
            put_finger(&mut hand, finger, vec3::scale(first, lengths[0]), aside, bends, lengths);
        }
        hand
    }
}

/// Motion of a hand over time.
#[derive(Clone, Debug)]
pub struct HandMotion {
    size: f64,
    start: HandPose,
    /// Start and end in seconds of the move to each pose, and the pose.
    moves: Vec<(f64, f64, HandPose)>,
}

impl HandMotion {
    pub fn sample(rng: &mut ChaCha8Rng, secs: f64) -> Self {
        let lively = rng.random_range(0.3..1.0);
        let start = HandPose::sample(rng);
        let (mut last, mut t, mut moves) = (start, -rng.random_range(0.0..1.0), Vec::new());
        while t < secs {
            let takes = rng.random_range(0.25..0.9) / (0.5 + 0.5 * lively);
            let wholly = rng.random_bool(0.5);
            let next = last.towards(&HandPose::sample(rng), if wholly { lively } else { 0.3 * lively });
            moves.push((t, t + takes, next));
            last = next;
            t += takes + if rng.random_bool(0.4) { 0.0 } else { rng.random_range(0.0..1.6) };
        }
        Self { size: (1.0 + 0.07 * normal(rng)).clamp(0.8, 1.2), start, moves }
    }

    /// A similar motion for the other hand.
    pub fn copied(&self, rng: &mut ChaCha8Rng) -> Self {
        let late = rng.random_range(-0.1..0.1);
        let other = HandPose::sample(rng);
        let near = |pose: &HandPose| pose.towards(&other, 0.15);
        let moves = self.moves.iter().map(|(a, b, pose)| (a + late, b + late, near(pose))).collect();
        Self { size: self.size, start: near(&self.start), moves }
    }

    fn at(&self, secs: f64) -> HandPose {
        self.moves.iter().take_while(|m| m.0 < secs).fold(self.start, |now, (leaves, has, next)| {
            let s = ((secs - leaves) / (has - leaves)).min(1.0);
            now.towards(next, s * s * s * (10.0 - 15.0 * s + 6.0 * s * s))
        })
    }

    /// Joints of the hand for each frame of an arm (shoulder, elbow, wrist; metres, x to the speaker's left, y down, z
    /// away from the viewer), `frame_secs` apart. In the rest pose of an arm stretched out in front of the body, the
    /// thumb lies in the plane of the arm.
    pub fn along(&self, arm: &[[Vec3; 3]], is_left: bool, frame_secs: f64) -> Vec<HandJoints> {
        let side = if is_left { -1.0 } else { 1.0 };
        let mut thumb = [0.0, -0.7, -0.7];
        let mut last = None;
        let hand = |(frame, [shoulder, elbow, wrist]): (usize, &[Vec3; 3])| {
            let upper = vec3::unit(vec3::sub(*elbow, *shoulder), 1e-6).unwrap_or([0.0, 1.0, 0.0]);
            let fore = vec3::unit(vec3::sub(*wrist, *elbow), 1e-6).unwrap_or(upper);
            // The thumb direction follows the forearm and is pulled towards its anatomical direction.
            let transported = last.map_or(thumb, |last| Rotation::between(last, fore).turn(thumb));
            let anatomical = vec3::across(vec3::sub([0.0, -0.3, -0.6], upper), fore);
            let both = vec3::add(vec3::scale(transported, 0.5), anatomical);
            thumb = vec3::unit(vec3::across(both, fore), 1e-6).unwrap_or_else(|| vec3::any_across(fore));
            last = Some(fore);
            let x = vec3::scale(thumb, side);
            let y = vec3::scale(fore, -1.0);
            let pose = self.at(frame as f64 * frame_secs);
            let [.., to_palm, to_thumb, palm_down] = pose.0;
            let about = Rotation::about;
            let held = about([0.0, 1.0, 0.0], side * palm_down)
                * about([1.0, 0.0, 0.0], to_palm)
                * about([0.0, 0.0, 1.0], side * to_thumb);
            let turn = Rotation::from_axes(x, y, vec3::cross(x, y)) * held;
            pose.hand(self.size).map(|[x, y, z]| vec3::add(*wrist, turn.turn([side * x, y, z])))
        };
        arm.iter().enumerate().map(hand).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// The forearm points ahead, the upper arm down, the wrist is straight.
    fn arm(is_left: bool) -> [Vec3; 3] {
        let x = if is_left { 0.2 } else { -0.2 };
        [[x, 0.0, 0.0], [x, 0.3, 0.0], [x, 0.3, -0.25]]
    }

    #[test]
    fn hands_are_where_anatomy_has_them() {
        let mut pose = HandPose([0.0; N]);
        pose.0[9] = 0.6;
        for palm_down in [0.0, std::f64::consts::FRAC_PI_2] {
            pose.0[14] = palm_down;
            let motion = HandMotion { size: 1.0, start: pose, moves: Vec::new() };
            for is_left in [false, true] {
                let hand = motion.along(&[arm(is_left); 40], is_left, 0.1)[39].map(|p| vec3::sub(p, arm(is_left)[2]));
                assert!(hand[9][2] < -0.08, "fingers ahead: {:?}", hand[9]);
                let inwards = if is_left { -1.0 } else { 1.0 };
                let thumb = vec3::sub(hand[2], hand[18]);
                if palm_down == 0.0 {
                    assert!(thumb[1] < -0.03, "thumb up: {thumb:?}");
                } else {
                    assert!(inwards * thumb[0] > 0.03, "thumb inwards: {thumb:?}");
                }
            }
        }
        pose.0[0] = 1.0;
        let fist = HandMotion { size: 1.0, start: pose, moves: Vec::new() };
        let hand = fist.along(&[arm(false); 40], false, 0.1)[39].map(|p| vec3::sub(p, arm(false)[2]));
        assert!(hand[11][1] > hand[9][1] + 0.03, "palm down, fingers close downwards: {hand:?}");
    }

    #[test]
    fn bones_keep_their_lengths_and_fingers_go_smoothly() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for _ in 0..10 {
            let motion = HandMotion::sample(&mut rng, 20.0);
            let hands = motion.along(&[arm(false); 300], false, 1.0 / 15.0);
            for pair in hands.windows(2) {
                for joint in 1..N_HAND {
                    let length = |hand: &HandJoints| {
                        vec3::norm(vec3::sub(hand[joint], hand[if joint % 4 == 1 { 0 } else { joint - 1 }]))
                    };
                    assert!((length(&pair[0]) - length(&pair[1])).abs() < 1e-9);
                    assert!(vec3::norm(vec3::sub(pair[0][joint], pair[1][joint])) < 0.12);
                }
            }
        }
    }
}
