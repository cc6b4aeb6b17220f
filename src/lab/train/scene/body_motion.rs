//! Procedural gestures of an upper body: wrists move between regions typical of a speaker (lap, desk, the space in
//! front, raised, hanging, the face), elbows follow by inverse kinematics, torso and head sway. This covers what free
//! motion capture lacks: seated speakers.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{L_HIP, L_SHOULDER, N_POINTS, NOSE, Pose, R_HIP, R_SHOULDER};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Bone lengths of a body in metres.
#[derive(Clone, Copy, Debug)]
pub struct Proportions {
    pub shoulders: f64,
    pub upper_arm: f64,
    pub forearm: f64,
    pub nose: f64,
    pub torso: f64,
    pub hips: f64,
}

impl Proportions {
    /// Mean adult.
    pub const MEAN: Self =
        Self { shoulders: 0.35, upper_arm: 0.29, forearm: 0.25, nose: 0.21, torso: 0.50, hips: 0.22 };

    /// Random proportions: relative lengths vary by 5 to 6 % among adults, and detectors and motion capture place
    /// joints slightly differently.
    pub fn sample(rng: &mut ChaCha8Rng) -> Self {
        let mut about = |mean: f64, share: f64| {
            let z: f64 = rng.sample(rand_distr::StandardNormal);
            mean * (1.0 + share * z.clamp(-2.5, 2.5))
        };
        Self {
            shoulders: about(0.35, 0.07),
            upper_arm: about(0.29, 0.06),
            forearm: about(0.25, 0.06),
            nose: about(0.21, 0.10),
            torso: about(0.50, 0.10),
            hips: about(0.22, 0.15),
        }
    }
}

/// Region of the wrist of the +x arm relative to the neck: ranges of x, y, z in metres. The speaker faces -z. The mean
/// wrist of measured speakers is 0.10 to 0.19 m in front of the neck, so the ranges begin near the body.
type WristRegion = [(f64, f64); 3];
const LAP: WristRegion = [(-0.08, 0.24), (0.36, 0.56), (-0.38, -0.08)];
const DESK: WristRegion = [(-0.10, 0.32), (0.20, 0.42), (-0.44, -0.12)];
const FRONT: WristRegion = [(-0.14, 0.42), (-0.04, 0.38), (-0.42, -0.05)];
const RAISED: WristRegion = [(-0.02, 0.48), (-0.48, 0.02), (-0.45, 0.0)];
const WIDE: WristRegion = [(0.28, 0.66), (-0.12, 0.42), (-0.36, 0.08)];
const HANGING: WristRegion = [(0.16, 0.34), (0.44, 0.58), (-0.14, 0.12)];
/// Pointing and stretching: most targets are out of reach, so that the arm is straight.
const REACH: WristRegion = [(-0.05, 0.75), (-0.50, 0.42), (-0.62, 0.05)];
const FACE: WristRegion = [(-0.10, 0.14), (-0.24, 0.02), (-0.26, -0.08)];
const HIP: WristRegion = [(0.16, 0.30), (0.36, 0.52), (-0.10, 0.10)];
const CROSSED: WristRegion = [(-0.22, -0.04), (0.18, 0.36), (-0.28, -0.10)];

/// Gesture habit of a speaker: rest region, gesture regions, probability of a rest, and the range of the elbows'
/// backward (+z) direction; seated speakers hold their elbows forward over desk or lap.
struct Habit {
    rest: WristRegion,
    gestures: &'static [WristRegion],
    rests: f64,
    back: (f64, f64),
}

const SEATED: (f64, f64) = (-1.1, 0.0);
const STANDING: (f64, f64) = (-0.5, 0.45);

const HABITS: [Habit; 7] = [
    Habit { rest: LAP, gestures: &[FRONT, FRONT, FRONT, DESK, LAP, WIDE, FACE], rests: 0.5, back: SEATED },
    Habit { rest: DESK, gestures: &[DESK, FRONT, FRONT, FRONT, WIDE, FACE, RAISED], rests: 0.45, back: SEATED },
    Habit { rest: FRONT, gestures: &[FRONT, FRONT, WIDE, RAISED, DESK], rests: 0.3, back: SEATED },
    Habit { rest: HANGING, gestures: &[FRONT, FRONT, WIDE, RAISED, HIP, FACE], rests: 0.4, back: STANDING },
    Habit { rest: CROSSED, gestures: &[FRONT, CROSSED, FACE, LAP], rests: 0.6, back: STANDING },
    Habit { rest: WIDE, gestures: &[RAISED, WIDE, FRONT, RAISED], rests: 0.2, back: STANDING },
    Habit { rest: HANGING, gestures: &[REACH, REACH, RAISED, FRONT, REACH], rests: 0.3, back: STANDING },
];

/// Generates `n_frames` poses, `frame_secs` apart, in metres and camera axes; the speaker faces the camera (-z).
pub fn gesture(rng: &mut ChaCha8Rng, n_frames: usize, frame_secs: f64) -> Vec<Pose> {
    let body = Proportions::sample(rng);
    let habit = &HABITS[rng.random_range(0..HABITS.len())];
    let secs = n_frames as f64 * frame_secs;
    let left = WristPath::sample(rng, habit, secs);
    let right = match rng.random_range(0..10) {
        0..4 => left.copied(rng),
        _ => WristPath::sample(rng, habit, secs),
    };
    let joined = rng.random_bool(0.12);
    let swivel = Swivel::sample(rng, habit.back);
    let sway = [0.14, 0.10, 0.08, 0.55, 0.30, 0.2, 0.025, 0.02, 0.04].map(|max| SlowSwing::sample(rng, max));
    let lean = rng.random_range(-0.1..0.6);
    let forward_lean = rng.random_range(0.0..0.06);
    let beat = BeatStroke::sample(rng);
    (0..n_frames)
        .map(|frame| {
            let t = frame as f64 * frame_secs;
            let s = sway.each_ref().map(|s| s.at(t));
            let mut pose: Pose = [[0.0; 3]; N_POINTS];
            for (side, shoulder, track) in [(1.0, L_SHOULDER, &left), (-1.0, R_SHOULDER, &right)] {
                let mut wrist = vec3::add(if joined { left.at(t) } else { track.at(t) }, beat.at(t, side));
                wrist[0] = if joined { side * 0.03 + s[6] } else { side * wrist[0] };
                let ahead = forward_lean * (-wrist[2] / 0.4).clamp(-0.2, 1.0);
                let at = [side * body.shoulders / 2.0, -s[6] * side - s[7], -ahead - s[8] * side];
                let (elbow, wrist) = bend(at, wrist, body.upper_arm, body.forearm, swivel.pole(t, side));
                (pose[shoulder], pose[shoulder + 1], pose[shoulder + 2]) = (at, elbow, wrist);
            }
            let head = turn(s[3], 0.05 + s[4], s[5]);
            pose[NOSE] = vec3::scale(head.turn([0.0, -0.80, -0.60]), body.nose);
            let spine = turn(0.0, lean, 0.0).turn([0.0, body.torso, 0.0]);
            pose[R_HIP] = vec3::add(spine, [-body.hips / 2.0, 0.0, 0.0]);
            pose[L_HIP] = vec3::add(spine, [body.hips / 2.0, 0.0, 0.0]);
            let torso = turn(s[0], s[1], s[2]);
            let neck = vec3::scale(vec3::add(pose[R_SHOULDER], pose[L_SHOULDER]), 0.5);
            pose.map(|p| torso.turn(vec3::sub(p, neck)))
        })
        .collect()
}

/// Rotation by roll, then pitch (positive: a speaker facing -z bows, or is seen from above), then yaw about the
/// vertical; radians.
pub fn turn(yaw: f64, pitch: f64, roll: f64) -> Rotation {
    let about = Rotation::about;
    about([0.0, 1.0, 0.0], yaw) * about([1.0, 0.0, 0.0], pitch) * about([0.0, 0.0, 1.0], roll)
}

/// Elbow and wrist of an arm that reaches from `shoulder` towards `wrist`, with the elbow bent towards `pole`. An
/// unreachable wrist is moved to the arm's length.
fn bend(shoulder: Vec3, wrist: Vec3, upper: f64, fore: f64, pole: Vec3) -> (Vec3, Vec3) {
    let along = vec3::sub(wrist, shoulder);
    let u = vec3::unit(along, 1e-6).unwrap_or([0.0, 1.0, 0.0]);
    let d = vec3::norm(along).clamp((upper - fore).abs() + 0.06, 0.998 * (upper + fore));
    let x = (upper * upper - fore * fore + d * d) / (2.0 * d);
    let height = (upper * upper - x * x).max(0.0).sqrt();
    let off = vec3::sub(pole, vec3::scale(u, vec3::dot(pole, u)));
    let off = vec3::unit(off, 1e-6).unwrap_or_else(|| vec3::any_across(u));
    let elbow = vec3::add(shoulder, vec3::add(vec3::scale(u, x), vec3::scale(off, height)));
    (elbow, vec3::add(shoulder, vec3::scale(u, d)))
}

/// Trajectory of the wrist of the +x arm: for each move its start and end in seconds and its target.
struct WristPath {
    start: Vec3,
    moves: Vec<(f64, f64, Vec3)>,
}

impl WristPath {
    fn sample(rng: &mut ChaCha8Rng, habit: &Habit, secs: f64) -> Self {
        let pace = rng.random_range(0.8..1.7);
        let random_wrist = |rng: &mut ChaCha8Rng| {
            let rests = rng.random_bool(habit.rests);
            let ranges = if rests { habit.rest } else { habit.gestures[rng.random_range(0..habit.gestures.len())] };
            ranges.map(|(low, high)| rng.random_range(low..high))
        };
        let start = random_wrist(rng);
        let mut last = start;
        let mut moves = Vec::new();
        let mut t = -rng.random_range(0.0..2.0);
        while t < secs {
            let is_new_target = rng.random_bool(0.6);
            let next = if is_new_target { random_wrist(rng) } else { last.map(|v| v + rng.random_range(-0.12..0.12)) };
            let far = vec3::norm(vec3::sub(next, last));
            let takes = pace * rng.random_range(0.2..0.45) * (0.4 + far / 0.3);
            moves.push((t, t + takes, next));
            last = next;
            t += takes + if rng.random_bool(0.5) { 0.0 } else { rng.random_range(0.0..1.5) };
        }
        Self { start, moves }
    }

    /// A similar path for the other arm: slightly shifted in time and space.
    fn copied(&self, rng: &mut ChaCha8Rng) -> Self {
        let late = rng.random_range(-0.08..0.08);
        let mut near = |p: Vec3| p.map(|v| v + rng.random_range(-0.05..0.05));
        let start = near(self.start);
        Self { start, moves: self.moves.iter().map(|&(a, b, p)| (a + late, b + late, near(p))).collect() }
    }

    fn at(&self, t: f64) -> Vec3 {
        let mut position = self.start;
        for &(leaves, arrives, next) in self.moves.iter().take_while(|m| m.0 < t) {
            let s = ((t - leaves) / (arrives - leaves)).min(1.0);
            let share = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s); // minimum jerk
            position = std::array::from_fn(|k| position[k] + share * (next[k] - position[k]));
        }
        position
    }
}

/// Direction of the elbows: down, outwards to a degree, slightly back or forward.
struct Swivel {
    out: SlowSwing,
    back: SlowSwing,
    mean_out: f64,
    mean_back: f64,
}

impl Swivel {
    fn sample(rng: &mut ChaCha8Rng, mean_back: (f64, f64)) -> Self {
        let (out, back) = (SlowSwing::sample(rng, 0.25), SlowSwing::sample(rng, 0.25));
        let (min, max) = mean_back;
        Self { out, back, mean_out: rng.random_range(0.0..1.1), mean_back: rng.random_range(min..max) }
    }

    fn pole(&self, t: f64, side: f64) -> Vec3 {
        [side * (self.mean_out + self.out.at(t)), 1.0, self.mean_back + self.back.at(t)]
    }
}

/// Slow sinusoidal oscillation about a mean.
pub struct SlowSwing {
    mean: f64,
    swing: f64,
    rate: f64,
    phase: f64,
}

impl SlowSwing {
    pub fn sample(rng: &mut ChaCha8Rng, max: f64) -> Self {
        let (mean, swing) = (rng.random_range(-max..max), 0.5 * rng.random_range(0.0..max));
        Self { mean, swing, rate: TAU * rng.random_range(0.05..0.6), phase: rng.random_range(0.0..TAU) }
    }

    /// Oscillation of 0.8 to 3.5 Hz about 0, as in beats.
    pub fn fast(rng: &mut ChaCha8Rng, max: f64) -> Self {
        let (swing, phase) = (rng.random_range(0.0..max), rng.random_range(0.0..TAU));
        Self { mean: 0.0, swing, rate: TAU * rng.random_range(0.8..3.5), phase }
    }

    pub fn at(&self, t: f64) -> f64 {
        self.mean + self.swing * (self.rate * t + self.phase).sin()
    }
}

/// Small fast oscillation added to the wrist position, like beat gestures.
struct BeatStroke {
    amplitude: Vec3,
    rate: f64,
    phase: f64,
}

impl BeatStroke {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        let max = if rng.random_bool(0.4) { rng.random_range(0.005..0.05) } else { 0.004 };
        let amplitude = std::array::from_fn(|_| rng.random_range(-max..max));
        Self { amplitude, rate: TAU * rng.random_range(0.8..3.5), phase: rng.random_range(0.0..TAU) }
    }

    fn at(&self, t: f64, side: f64) -> Vec3 {
        vec3::scale(self.amplitude, (self.rate * t + self.phase + 0.3 * side).sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::motion::upper_body::{R_ELBOW, R_WRIST};
    use rand::SeedableRng;

    #[test]
    fn bones_keep_their_length_and_nothing_jumps() {
        for seed in 0..60 {
            let poses = gesture(&mut ChaCha8Rng::seed_from_u64(seed), 60, 1.0 / 15.0);
            let bone = |p: &Pose, a: usize, b: usize| vec3::norm(vec3::sub(p[a], p[b]));
            for pair in poses.windows(2) {
                for (a, b) in orator_base::types::skeleton::ARM_BONES {
                    assert!((bone(&pair[0], a, b) - bone(&pair[1], a, b)).abs() < 1e-9);
                }
                let step = (0..N_POINTS).map(|j| vec3::norm(vec3::sub(pair[1][j], pair[0][j]))).fold(0.0, f64::max);
                assert!(step < 0.55, "seed {seed}: {step}");
                let neck = vec3::add(pair[0][R_SHOULDER], pair[0][L_SHOULDER]);
                assert!(vec3::norm(neck) < 1e-9);
            }
        }
    }

    #[test]
    fn a_speaker_faces_the_camera_with_elbows_below() {
        let (mut below, mut behind, mut forward) = (0, 0, 0);
        for seed in 0..500 {
            let pose = gesture(&mut ChaCha8Rng::seed_from_u64(seed), 1, 0.1)[0];
            assert!(pose[NOSE][1] < -0.05 && pose[NOSE][2] < 0.03 && pose[R_SHOULDER][0] < -0.1, "{pose:?}");
            below += usize::from(pose[R_ELBOW][1] > pose[R_SHOULDER][1]);
            if pose[R_WRIST][2] < pose[R_SHOULDER][2] - 0.1 {
                behind += usize::from(pose[R_ELBOW][2] > pose[R_SHOULDER][2] + 0.05);
                forward += usize::from(pose[R_ELBOW][2] < pose[R_SHOULDER][2] - 0.03);
            }
        }
        eprintln!("of 500: {below} elbows below, {behind} behind, {forward} before the shoulder");
        assert!(below > 400 && forward > 200 && behind < 60, "{below} {behind} {forward}");
    }
}
