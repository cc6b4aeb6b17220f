//! Motion over the complete reachable space of the arms, within the limits of the joints rather than a repertoire of
//! gestures: poses of joint angles with minimum-jerk movements between them, durations and pauses as in captured
//! motion, trunk, shoulder girdle and head turned independently.

use super::body_motion::{Proportions, SlowSwing, turn};
use super::hand_shape::normal;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{L_HIP, L_SHOULDER, N_POINTS, NOSE, Pose, R_HIP, R_SHOULDER};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Joint angles of the +x arm of a speaker who faces -z with y down, radians.
#[derive(Clone, Copy, Debug)]
struct ArmAngles {
    /// Elevation of the upper arm from hanging, and its direction about the vertical: 0 to the side, a quarter turn to
    /// the front, half a turn across the body.
    elevation: f64,
    azimuth: f64,
    /// Rotation about the upper arm: outwards positive; at 0 the forearm of a hanging arm bends to the front.
    twist: f64,
    /// Bend of the elbow; 0: straight.
    bend: f64,
}

/// Largest elevation to the front or the side, and to the back; range of the azimuth; twist inwards and outwards; bend.
const MAX_ELEVATION: f64 = 2.7;
const MAX_BACK: f64 = 0.9;
const AZIMUTH: [f64; 2] = [-1.4, 2.4];
const TWIST: [f64; 2] = [-1.5, 1.2];
const MAX_BEND: f64 = 2.55;
/// Radii of trunk and head that wrists stay out of, metres; number of draws before a pose is accepted nevertheless.
const TRUNK: f64 = 0.10;
const HEAD: f64 = 0.11;
const N_DRAWS: usize = 12;

impl ArmAngles {
    /// A random pose within the limits; `rise` is the standard deviation of the elevation.
    fn sample(rng: &mut ChaCha8Rng, rise: f64) -> Self {
        let azimuth = rng.random_range(AZIMUTH[0]..AZIMUTH[1]);
        let elevation = (rise * normal(rng)).abs();
        let twist = -0.45 + 0.75 * normal(rng);
        let bend = if rng.random_bool(0.7) { 1.45 + 0.55 * normal(rng) } else { rng.random_range(0.0..MAX_BEND) };
        Self { elevation, azimuth, twist, bend }.within_limits()
    }

    fn within_limits(self) -> Self {
        let azimuth = self.azimuth.clamp(AZIMUTH[0], AZIMUTH[1]);
        // To the back and across the body, the reach decreases.
        let back = (-azimuth.sin()).max(0.0);
        let across = (-azimuth.cos()).max(0.0);
        let most = MAX_ELEVATION + back * (MAX_BACK - MAX_ELEVATION);
        Self {
            elevation: self.elevation.clamp(0.0, most * (1.0 - 0.35 * across)),
            azimuth,
            twist: self.twist.clamp(TWIST[0], TWIST[1]),
            bend: self.bend.clamp(0.03, MAX_BEND),
        }
    }

    fn plus(self, other: [f64; 4]) -> Self {
        let [elevation, azimuth, twist, bend] = other;
        Self {
            elevation: self.elevation + elevation,
            azimuth: self.azimuth + azimuth,
            twist: self.twist + twist,
            bend: self.bend + bend,
        }
    }

    fn towards(self, to: Self, share: f64) -> Self {
        let step = |from: f64, to: f64| share * (to - from);
        self.plus([
            step(self.elevation, to.elevation),
            step(self.azimuth, to.azimuth),
            step(self.twist, to.twist),
            step(self.bend, to.bend),
        ])
    }

    /// Directions of upper arm and forearm of the +x arm.
    fn directions(self) -> [Vec3; 2] {
        let (sin, cos) = self.elevation.sin_cos();
        let upper = [sin * self.azimuth.cos(), cos, -sin * self.azimuth.sin()];
        // The forearm bends to the front of the hanging arm; the shortest rotation carries that front along.
        let swing = Rotation::between([0.0, 1.0, 0.0], upper);
        let front = Rotation::about(upper, -self.twist).turn(swing.turn([0.0, 0.0, -1.0]));
        let forearm = vec3::add(vec3::scale(upper, self.bend.cos()), vec3::scale(front, self.bend.sin()));
        [upper, forearm]
    }

    /// Whether the wrist of an arm of mean length is outside trunk and head.
    fn is_free(self) -> bool {
        let body = Proportions::MEAN;
        let [upper, forearm] = self.directions();
        let shoulder = [body.shoulders / 2.0, 0.0, 0.0];
        let elbow = vec3::add(shoulder, vec3::scale(upper, body.upper_arm));
        let wrist = vec3::add(elbow, vec3::scale(forearm, body.forearm));
        let from_trunk = |p: Vec3| ((p[0] / 1.6).hypot(p[2]), p[1]);
        let outside = |p: Vec3| from_trunk(p).0 > TRUNK || !(-0.05..0.55).contains(&from_trunk(p).1);
        outside(wrist) && outside(elbow) && vec3::norm(vec3::sub(wrist, [0.0, -0.17, -0.03])) > HEAD
    }
}

/// Angles of an arm over time: for each movement its start and end in seconds and its target.
struct ArmPath {
    start: ArmAngles,
    moves: Vec<(f64, f64, ArmAngles)>,
    /// Trembling and beats: slow and fast oscillations of each angle.
    swings: [[SlowSwing; 2]; 4],
}

impl ArmPath {
    fn sample(rng: &mut ChaCha8Rng, secs: f64) -> Self {
        let pace = rng.random_range(-0.7f64..0.5).exp();
        let rise = [0.35, 0.7, 1.2][rng.random_range(0..3)];
        let (new_pose, pause) = (rng.random_range(0.2..0.9), rng.random_range(0.05..1.2));
        let free = |rng: &mut ChaCha8Rng, near: Option<ArmAngles>| {
            let draw = |rng: &mut ChaCha8Rng| {
                let Some(near) = near else { return ArmAngles::sample(rng, rise) };
                near.plus([0.2, 0.3, 0.35, 0.4].map(|std| std * normal(rng))).within_limits()
            };
            (1..N_DRAWS).fold(draw(rng), |angles, _| if angles.is_free() { angles } else { draw(rng) })
        };
        let start = free(rng, None);
        let (mut last, mut moves) = (start, Vec::new());
        let mut t = -rng.random_range(0.0..1.5);
        while t < secs {
            let near = (!rng.random_bool(new_pose)).then_some(last);
            let next = free(rng, near);
            let far = [
                next.elevation - last.elevation,
                (next.azimuth - last.azimuth) * last.elevation.sin(),
                0.5 * (next.twist - last.twist),
                0.6 * (next.bend - last.bend),
            ];
            let far = far.iter().map(|v| v * v).sum::<f64>().sqrt();
            // Movements of captured arms last 0.2 to 1.2 s and grow with the root of their size.
            let takes = pace * rng.random_range(0.3..0.9) * (0.25 + far.sqrt());
            moves.push((t, t + takes, next));
            last = next;
            t += takes * rng.random_range(0.85..1.0) - pause * rng.random_range(1e-9f64..1.0).ln() * 0.5;
        }
        let shake = if rng.random_bool(0.5) { 0.12 } else { 0.03 };
        let swings = [0; 4].map(|_| [SlowSwing::sample(rng, 0.15), SlowSwing::fast(rng, shake)]);
        Self { start, moves, swings }
    }

    /// A similar path for the other arm, slightly shifted in time and space.
    fn copied(&self, rng: &mut ChaCha8Rng) -> Self {
        let late = rng.random_range(-0.1..0.1);
        let shift = [0.1, 0.2, 0.2, 0.2].map(|std| std * normal(rng));
        let near = |angles: ArmAngles| angles.plus(shift).within_limits();
        let swings = [0; 4].map(|_| [SlowSwing::sample(rng, 0.15), SlowSwing::fast(rng, 0.03)]);
        let moves = self.moves.iter().map(|&(a, b, angles)| (a + late, b + late, near(angles))).collect();
        Self { start: near(self.start), moves, swings }
    }

    fn at(&self, t: f64) -> ArmAngles {
        let mut angles = self.start;
        for &(leaves, arrives, next) in self.moves.iter().take_while(|m| m.0 < t) {
            let s = ((t - leaves) / (arrives - leaves)).min(1.0);
            angles = angles.towards(next, s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)); // minimum jerk
        }
        angles
            .plus(self.swings.each_ref().map(|of_angle| of_angle.iter().map(|swing| swing.at(t)).sum()))
            .within_limits()
    }
}

/// Generates `n_frames` poses, `frame_secs` apart, in metres and camera axes; the body faces the camera (-z) on average.
pub fn motion(rng: &mut ChaCha8Rng, n_frames: usize, frame_secs: f64) -> Vec<Pose> {
    let body = Proportions::sample(rng);
    let secs = n_frames as f64 * frame_secs;
    let left = ArmPath::sample(rng, secs);
    let right = if rng.random_bool(0.35) { left.copied(rng) } else { ArmPath::sample(rng, secs) };
    let lean = rng.random_range(-0.1..0.5);
    // Whole body: yaw, pitch, roll; girdle against the trunk: yaw, roll; head: yaw, pitch, roll; depth of each shoulder.
    let turning = if rng.random_bool(0.3) { 0.6 } else { 0.15 };
    let swings = [turning, 0.12, 0.08, 0.25, 0.12, 0.8, 0.35, 0.25].map(|max| SlowSwing::sample(rng, max));
    (0..n_frames)
        .map(|frame| {
            let t = frame as f64 * frame_secs;
            let [yaw, pitch, roll, girdle_yaw, girdle_roll, head_yaw, head_pitch, head_roll] =
                swings.each_ref().map(|swing| swing.at(t));
            let girdle = turn(girdle_yaw, 0.0, girdle_roll);
            let mut pose: Pose = [[0.0; 3]; N_POINTS];
            for (side, shoulder, path) in [(1.0, L_SHOULDER, &left), (-1.0, R_SHOULDER, &right)] {
                let angles = path.at(t);
                // A raised arm lifts its shoulder by up to 4 cm, and one to the front draws it forward.
                let lift = 0.04 * (angles.elevation / MAX_ELEVATION).powi(2);
                let forward = 0.03 * angles.elevation.sin() * angles.azimuth.sin();
                let at = girdle.turn([side * body.shoulders / 2.0, -lift, -forward]);
                let [upper, forearm] = angles.directions().map(|[x, y, z]| girdle.turn([side * x, y, z]));
                pose[shoulder] = at;
                pose[shoulder + 1] = vec3::add(at, vec3::scale(upper, body.upper_arm));
                pose[shoulder + 2] = vec3::add(pose[shoulder + 1], vec3::scale(forearm, body.forearm));
            }
            // The neck carries half of the head's rotation.
            let half = turn(head_yaw / 2.0, head_pitch / 2.0, head_roll / 2.0);
            let head = turn(head_yaw, 0.05 + head_pitch, head_roll);
            let nose = vec3::add(half.turn([0.0, -0.45, -0.1]), head.turn([0.0, -0.35, -0.5]));
            pose[NOSE] = vec3::scale(nose, body.nose);
            let spine = turn(0.0, lean, 0.0).turn([0.0, body.torso, 0.0]);
            pose[R_HIP] = vec3::add(spine, [-body.hips / 2.0, 0.0, 0.0]);
            pose[L_HIP] = vec3::add(spine, [body.hips / 2.0, 0.0, 0.0]);
            let trunk = turn(yaw, pitch, roll);
            let neck = vec3::scale(vec3::add(pose[R_SHOULDER], pose[L_SHOULDER]), 0.5);
            pose.map(|p| trunk.turn(vec3::sub(p, neck)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::motion::upper_body::{L_ELBOW, L_WRIST, R_ELBOW, R_WRIST};
    use rand::SeedableRng;

    #[test]
    fn the_front_of_an_arm_is_where_the_limits_say() {
        let arm = |elevation: f64, azimuth: f64, twist: f64| {
            ArmAngles { elevation, azimuth, twist, bend: std::f64::consts::FRAC_PI_2 }.directions()
        };
        let near = |a: Vec3, b: Vec3| assert!(vec3::norm(vec3::sub(a, b)) < 1e-6, "{a:?} {b:?}");
        let quarter = std::f64::consts::FRAC_PI_2;
        near(arm(0.0, 0.0, 0.0)[1], [0.0, 0.0, -1.0]);
        near(arm(0.0, 0.0, quarter)[1], [1.0, 0.0, 0.0]);
        near(arm(quarter, quarter, 0.0)[0], [0.0, 0.0, -1.0]);
        near(arm(quarter, quarter, 0.0)[1], [0.0, -1.0, 0.0]);
        near(arm(quarter, quarter, -quarter)[1], [-1.0, 0.0, 0.0]);
        near(arm(quarter, 0.0, quarter)[1], [0.0, -1.0, 0.0]);
    }

    #[test]
    fn arms_keep_their_lengths_and_cover_the_space() {
        let (mut wrists, mut speeds) = (Vec::new(), Vec::new());
        for seed in 0..300 {
            let poses = motion(&mut ChaCha8Rng::seed_from_u64(seed), 45, 1.0 / 15.0);
            let bone = |p: &Pose, a: usize, b: usize| vec3::norm(vec3::sub(p[a], p[b]));
            for pair in poses.windows(2) {
                for (a, b) in [(L_SHOULDER, L_ELBOW), (L_ELBOW, L_WRIST), (R_SHOULDER, R_ELBOW), (R_ELBOW, R_WRIST)] {
                    assert!((bone(&pair[0], a, b) - bone(&pair[1], a, b)).abs() < 1e-9);
                }
                speeds.push(vec3::norm(vec3::sub(pair[1][L_WRIST], pair[0][L_WRIST])));
            }
            wrists.extend(poses.iter().map(|p| p[L_WRIST]));
        }
        speeds.sort_by(f64::total_cmp);
        let quantile = |share: f64| speeds[(share * (speeds.len() - 1) as f64) as usize];
        let share = |of: &dyn Fn(&Vec3) -> bool| wrists.iter().filter(|p| of(p)).count() as f64 / wrists.len() as f64;
        eprintln!(
            "wrist speed, m per frame: {:.3} {:.3} {:.3} {:.3}; above the shoulders {:.2}, across {:.2}, behind {:.2}",
            quantile(0.25),
            quantile(0.5),
            quantile(0.75),
            quantile(0.95),
            share(&|p| p[1] < 0.0),
            share(&|p| p[0] < 0.0),
            share(&|p| p[2] > 0.05)
        );
        assert!(quantile(0.99) < 0.5 && (0.005..0.06).contains(&quantile(0.5)));
        assert!(share(&|p| p[1] < 0.0) > 0.1 && share(&|p| p[0] < 0.0) > 0.05 && share(&|p| p[2] > 0.05) > 0.05);
    }
}
