//! Synthetic camera views of a moving upper body: ground truth in camera axes, and 2D keypoints with the noise, bias,
//! outliers and gaps of a detector. The ranges of angles, focal lengths and noise are documented at each draw.

use super::body_motion;
use super::body_motion::{Proportions, SlowSwing, turn};
use super::hand_direction;
use super::hand_shape::{normal, random_rotation};
use super::jumps;
use super::noise;
use super::reach;
use crate::mocap::upper_body::BodyTake;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{
    BodyPoints, HandDirections, L_ELBOW, L_HIP, L_SHOULDER, L_WRIST, MIRROR, N_POINTS, NOSE, Pose, R_HIP, R_SHOULDER,
    R_WRIST,
};
use orator_base::types::skeleton;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Frame rate of the scenes, frames/s: the rate at which the lifter runs.
pub const FPS: f64 = 15.0;

/// Share of training scenes that use the measured noise of real pose models (the others use the assumed noise of
/// `perturb`), and the share of those that use the measured bias (the others: a bias of equal size in a random
/// direction).
const MEASURED_NOISE: f64 = 0.7;
const MEASURED_BIAS: f64 = 0.7;
/// Share of the captured arms that are moved to other directions in training, and the standard deviation per axis of
/// the rotations of the arm and, in addition, of the forearm, radians.
const MOVED: f64 = 0.5;
const MOVED_BY: [f64; 2] = [0.2, 0.25];
/// Share of the captured scenes in which the body turns, and the largest angle to either side.
const TURNING: f64 = 0.3;
const TURNS_BY: f64 = 0.6;

/// A filmed scene: ground-truth poses in metres and camera axes, and the 2D keypoints.
#[derive(Clone, Debug)]
pub struct FilmedScene {
    pub truth: Vec<Pose>,
    pub seen: Vec<BodyPoints>,
    /// Directions of the hands as a hand model sees them.
    pub hands: Vec<HandDirections>,
    /// [T]; whether a frame has a gross error (`jumps`); such frames are not training targets.
    pub disturbed: Vec<bool>,
    /// Camera yaw relative to the body's mean front, radians; 0: frontal view.
    pub yaw: f64,
    /// Neck position in camera axes, metres, and focal length in px; the principal point is (0, 0).
    pub neck: Vec3,
    pub focal_px: f64,
    /// Scale of the image at the neck's distance, px per metre.
    pub px_per_metre: f64,
}

/// Purpose of a scene, which decides how strongly it is perturbed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filming {
    /// Training: random body proportions and playback speed, better and worse detectors, a wider range of views.
    Training,
    /// Evaluation, condition "drop": mean adult proportions, a detector with noise and missing points.
    Drop,
    /// Evaluation with exact keypoints.
    Clean,
}

impl FilmedScene {
    /// Films a random excerpt of `take` from a random side within 60 degrees. In training, the left arm may come from
    /// `other`, which decorrelates the two arms. Returns `None` if the take is too short.
    pub fn from_take(
        take: &BodyTake,
        other: Option<&BodyTake>,
        filming: Filming,
        n_frames: usize,
        rng: &mut ChaCha8Rng,
    ) -> Option<Self> {
        let training = filming == Filming::Training;
        let mut poses = excerpt(take, training, n_frames, rng)?;
        if let Some(other) = other.and_then(|other| excerpt(other, training, n_frames, rng)) {
            poses.iter_mut().zip(&other).for_each(|(pose, other)| replace_left_arm(pose, other));
        }
        let unchanged = training && take.rendered;
        if !unchanged {
            let bones = if training { Proportions::sample(rng) } else { Proportions::MEAN };
            poses.iter_mut().for_each(|pose| *pose = with_bone_lengths(pose, &bones));
        }
        if training && !unchanged {
            move_arms(&mut poses, rng);
            let [yaw, pitch, roll] = [0.7, 0.3, 0.2].map(|max| SlowSwing::sample(rng, max));
            let turns_by = if rng.random_bool(TURNING) { TURNS_BY } else { 0.1 };
            let turning = SlowSwing::sample(rng, turns_by);
            for (i, pose) in poses.iter_mut().enumerate() {
                let t = i as f64 / FPS;
                pose[NOSE] = turn(yaw.at(t), pitch.at(t), roll.at(t)).turn(pose[NOSE]);
                let body = turn(turning.at(t), 0.0, 0.0);
                *pose = pose.map(|p| body.turn(p));
            }
        }
        Some(Self::filmed(poses, filming, rng))
    }

    /// Films motion over the reachable space of the arms.
    pub fn from_reach(filming: Filming, n_frames: usize, rng: &mut ChaCha8Rng) -> Self {
        let poses = reach::motion(rng, n_frames, 1.0 / FPS);
        Self::filmed(poses, filming, rng)
    }

    /// Films procedurally generated motion.
    pub fn from_rule(filming: Filming, n_frames: usize, rng: &mut ChaCha8Rng) -> Self {
        let poses = body_motion::gesture(rng, n_frames, 1.0 / FPS);
        Self::filmed(poses, filming, rng)
    }

    /// Films poses that face the camera on average.
    fn filmed(mut poses: Vec<Pose>, filming: Filming, rng: &mut ChaCha8Rng) -> Self {
        let training = filming == Filming::Training;
        if training && rng.random_bool(0.5) {
            poses.iter_mut().for_each(|pose| *pose = MIRROR.map(|j| [-pose[j][0], pose[j][1], pose[j][2]]));
        }
        // Yaw within 60 degrees, in 40 % of training scenes within 29; elevation -15 to 15 degrees, in training up to
        // 25; roll within 4 degrees, in a third of the training scenes within 15.
        let yaw = if training && rng.random_bool(0.4) { 0.5 } else { 1.047 };
        let yaw = rng.random_range(-yaw..yaw);
        let above = if training { 0.44 } else { 0.262 };
        let roll = if training && rng.random_bool(0.33) { 0.26 } else { 0.07 };
        let view = turn(0.0, rng.random_range(-0.262..above), rng.random_range(-roll..roll)) * turn(yaw, 0.0, 0.0);
        let truth: Vec<Pose> = poses.iter().map(|pose| pose.map(|p| view.turn(p))).collect();
        // The focal length is in image widths; a body of 0.75 m covers 50 to 150 % of the height of a 16:9 image.
        let focal: f64 = rng.random_range(1.0..2.2);
        let distance = (focal * 0.75 / (rng.random_range(0.5..1.5) * 9.0 / 16.0)).max(0.85);
        let neck: Vec3 = [
            rng.random_range(-0.25..0.25) * distance / focal,
            rng.random_range(-0.25..0.2) * distance / focal,
            distance,
        ];
        let focal_px = 1280.0 * focal;
        let picture = |p: Vec3| {
            let [x, y, z] = vec3::add(p, neck);
            [0, 1].map(|k| (focal_px * [x, y][k] / z.max(0.2)) as f32)
        };
        let mut seen: Vec<BodyPoints> = truth.iter().map(|pose| pose.map(|p| Some(picture(p)))).collect();
        let px_per_metre = focal_px / distance;
        if filming != Filming::Clean {
            let shoulders = vec3::norm(vec3::sub(truth[0][R_SHOULDER], truth[0][L_SHOULDER]));
            if !(training && perturb_as_measured(&mut seen, shoulders * px_per_metre, rng)) {
                perturb(&mut seen, 0.35 * px_per_metre, training, rng);
            }
            drop_hips(&mut seen, 0.35 * px_per_metre, training, rng);
        }
        let disturbed =
            if training { jumps::disturb(&mut seen, 0.35 * px_per_metre, rng) } else { vec![false; seen.len()] };
        // A stream of its own, so that scenes without hands stay as they are.
        let hands = hand_direction::observed(&truth, 1.0 / FPS, &mut ChaCha8Rng::seed_from_u64(yaw.to_bits()));
        Self { truth, seen, hands, disturbed, yaw, neck, focal_px, px_per_metre }
    }
}

/// Adds assumed noise, outliers and gaps. `shoulders_px` is the true shoulder width in px. In training the noise level
/// varies and each point has a constant bias.
fn perturb(seen: &mut [BodyPoints], shoulders_px: f64, training: bool, rng: &mut ChaCha8Rng) {
    // Detectors and motion capture place shoulders and elbows up to a few cm apart, which is constant over a scene.
    let bias = if !training {
        0.0
    } else if rng.random_bool(0.5) {
        1.2
    } else {
        4.0
    };
    let scale = if training { rng.random_range(-1.2f64..0.7).exp() } else { 1.0 };
    for point in 0..N_POINTS {
        // 1 % of the shoulder width; detectors are less accurate on wrists and hips.
        let share = match point {
            R_WRIST | L_WRIST => 0.012,
            R_HIP | L_HIP => 0.018,
            _ => 0.010,
        };
        let bias = [0, 1].map(|_| bias * normal(rng));
        for frame in seen.iter_mut() {
            let stray = if rng.random_bool(0.01) { 12.0 } else { 1.0 };
            if let Some(p) = &mut frame[point] {
                for (v, bias) in p.iter_mut().zip(bias) {
                    *v += (shoulders_px * share * (bias + scale * stray * normal(rng))) as f32;
                }
            }
        }
        // Gaps of 1 to 12 frames; one begins in 1.7 % of the frames, so that a tenth of the frames is missing.
        let gaps = match (training, rng.random_bool(0.4)) {
            (true, true) => 0.0,
            (true, false) => rng.random_range(0.0..0.05),
            (false, _) => 0.017,
        };
        let mut t = 0;
        while t < seen.len() {
            if rng.random_bool(gaps) {
                let n = rng.random_range(1..=12);
                seen.iter_mut().skip(t).take(n).for_each(|f| f[point] = None);
                t += n;
            }
            t += 1;
        }
        if training && (point == R_WRIST || point == L_WRIST || point == NOSE) && rng.random_bool(0.03) {
            seen.iter_mut().for_each(|f| f[point] = None);
        }
    }
}

/// Adds the measured noise of a random model set in 70 % of the scenes; returns whether it did.
fn perturb_as_measured(seen: &mut [BodyPoints], shoulders_px: f64, rng: &mut ChaCha8Rng) -> bool {
    let sets = &noise::measured().bodies;
    if sets.is_empty() || !rng.random_bool(MEASURED_NOISE) {
        return false;
    }
    let set = &sets[rng.random_range(0..sets.len())];
    let scale = rng.random_range(-0.7f64..0.4).exp();
    let with_bias = rng.random_bool(MEASURED_BIAS);
    set.apply(seen, shoulders_px, scale, with_bias, rng);
    true
}

/// Removes the hips in 60 % of the scenes: they are often hidden by a desk or below the image.
fn drop_hips(seen: &mut [BodyPoints], shoulders_px: f64, training: bool, rng: &mut ChaCha8Rng) {
    if rng.random_bool(0.6) {
        seen.iter_mut().for_each(|f| (f[R_HIP], f[L_HIP]) = (None, None));
    } else if training && rng.random_bool(0.5) {
        guess_hips(seen, shoulders_px, rng);
    }
}

/// Places the hips straight below the shoulders, as many detectors do when a desk or the image border hides them.
fn guess_hips(seen: &mut [BodyPoints], shoulders_px: f64, rng: &mut ChaCha8Rng) {
    let (below, width) = (rng.random_range(0.8..1.7), rng.random_range(0.25..0.75));
    let aside = 0.1 * normal(rng);
    for frame in seen.iter_mut() {
        let (Some(right), Some(left)) = (frame[R_SHOULDER], frame[L_SHOULDER]) else { continue };
        for (hip, side) in [(R_HIP, -0.5), (L_HIP, 0.5)] {
            let middle = [0, 1].map(|k| f64::from(right[k] + left[k]) / 2.0);
            let position = [aside + side * width + 0.02 * normal(rng), below + 0.02 * normal(rng)];
            frame[hip] = frame[hip].map(|_| [0, 1].map(|k| (middle[k] + shoulders_px * position[k]) as f32));
        }
    }
}

/// A random excerpt of a take at `FPS`, rotated so that it faces the camera on average.
fn excerpt(take: &BodyTake, training: bool, n_frames: usize, rng: &mut ChaCha8Rng) -> Option<Vec<Pose>> {
    let speed = if training { rng.random_range(-0.5f64..0.4).exp() } else { 1.0 };
    let step = speed * take.fps / FPS;
    let room = take.poses.len() as f64 - 1.0 - step * (n_frames as f64 - 1.0);
    if room < 0.0 {
        return None;
    }
    let start = rng.random_range(0.0..=room);
    let poses: Vec<Pose> = (0..n_frames).map(|i| interpolate(&take.poses, start + step * i as f64)).collect();
    let ahead = turn(-facing(&poses), 0.0, 0.0);
    Some(poses.iter().map(|pose| pose.map(|p| ahead.turn(p))).collect())
}

/// Replaces the left arm of `pose` by that of `other`, rotated with the shoulder line.
fn replace_left_arm(pose: &mut Pose, other: &Pose) {
    let across = turn(facing(std::slice::from_ref(pose)) - facing(std::slice::from_ref(other)), 0.0, 0.0);
    let from = |joint: usize| across.turn(vec3::sub(other[joint], other[L_SHOULDER]));
    let shoulder = pose[L_SHOULDER];
    pose[L_ELBOW] = vec3::add(shoulder, from(L_ELBOW));
    pose[L_WRIST] = vec3::add(shoulder, from(L_WRIST));
}

/// Rotates arms by a random constant rotation about the shoulder, and forearms by another about the elbow: the dynamics
/// of the capture in other directions.
fn move_arms(poses: &mut [Pose], rng: &mut ChaCha8Rng) {
    for [shoulder, elbow, wrist] in skeleton::ARMS {
        if !rng.random_bool(MOVED) {
            continue;
        }
        let [arm, fore] = MOVED_BY.map(|std| {
            let axis = random_rotation(rng).turn([0.0, 0.0, 1.0]);
            Rotation::about(axis, 3f64.sqrt() * std * normal(rng))
        });
        for pose in poses.iter_mut() {
            let upper = arm.turn(vec3::sub(pose[elbow], pose[shoulder]));
            let forearm = fore.turn(arm.turn(vec3::sub(pose[wrist], pose[elbow])));
            pose[elbow] = vec3::add(pose[shoulder], upper);
            pose[wrist] = vec3::add(pose[elbow], forearm);
        }
    }
}

/// Frames of an evaluation scene (4 s), and the seed of the evaluation scenes.
const MEASURED_FRAMES: usize = 60;
const MEASURED_SEED: u64 = 20_000;

/// `n` reproducible evaluation scenes, from `takes` in turn or, if there are none, from procedural motion. Takes
/// shorter than a scene are skipped; the result is empty if all are.
pub fn scenes(takes: &[BodyTake], filming: Filming, n: usize) -> Vec<FilmedScene> {
    let mut rng = ChaCha8Rng::seed_from_u64(MEASURED_SEED);
    if takes.is_empty() {
        return (0..n).map(|_| FilmedScene::from_rule(filming, MEASURED_FRAMES, &mut rng)).collect();
    }
    let long: Vec<&BodyTake> = takes.iter().filter(|t| t.n_frames_at(FPS) >= MEASURED_FRAMES).collect();
    (0..if long.is_empty() { 0 } else { n })
        .filter_map(|i| FilmedScene::from_take(long[i % long.len()], None, filming, MEASURED_FRAMES, &mut rng))
        .collect()
}

/// The linearly interpolated pose at frame position `at`.
fn interpolate(poses: &[Pose], at: f64) -> Pose {
    let before = (at.max(0.0) as usize).min(poses.len() - 1);
    let after = (before + 1).min(poses.len() - 1);
    let share = at - before as f64;
    std::array::from_fn(|j| {
        std::array::from_fn(|k| poses[before][j][k] + share * (poses[after][j][k] - poses[before][j][k]))
    })
}

/// Mean yaw of the shoulder line, radians; 0 faces the camera.
fn facing(poses: &[Pose]) -> f64 {
    let across = poses.iter().fold([0.0; 3], |sum, p| vec3::add(sum, vec3::sub(p[L_SHOULDER], p[R_SHOULDER])));
    (-across[2]).atan2(across[0])
}

/// The pose with unchanged bone directions and other bone lengths.
fn with_bone_lengths(pose: &Pose, bones: &Proportions) -> Pose {
    let along = |from: Vec3, to: Vec3, length: f64| {
        vec3::scale(vec3::unit(vec3::sub(to, from), 1e-9).unwrap_or([0.0, 1.0, 0.0]), length)
    };
    let mut new: Pose = [[0.0; 3]; N_POINTS];
    new[L_SHOULDER] = along(pose[R_SHOULDER], pose[L_SHOULDER], bones.shoulders / 2.0);
    new[R_SHOULDER] = vec3::scale(new[L_SHOULDER], -1.0);
    for [shoulder, elbow, wrist] in skeleton::ARMS {
        new[elbow] = vec3::add(new[shoulder], along(pose[shoulder], pose[elbow], bones.upper_arm));
        new[wrist] = vec3::add(new[elbow], along(pose[elbow], pose[wrist], bones.forearm));
    }
    new[NOSE] = along([0.0; 3], pose[NOSE], bones.nose);
    let pelvis = vec3::scale(vec3::add(pose[R_HIP], pose[L_HIP]), 0.5);
    let half = along(pose[R_HIP], pose[L_HIP], bones.hips / 2.0);
    let pelvis = along([0.0; 3], pelvis, bones.torso);
    (new[R_HIP], new[L_HIP]) = (vec3::sub(pelvis, half), vec3::add(pelvis, half));
    new
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::motion::upper_body::R_ELBOW;

    fn take() -> BodyTake {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let poses = body_motion::gesture(&mut rng, 300, 1.0 / 60.0);
        // Turned away from the camera; `from_take` turns it back.
        BodyTake {
            name: "t".into(),
            fps: 60.0,
            rendered: false,
            poses: poses.iter().map(|p| p.map(|q| turn(2.5, 0.0, 0.0).turn(q))).collect(),
        }
    }

    #[test]
    fn a_clean_scene_is_its_own_projection() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20 {
            let scene = FilmedScene::from_take(&take(), None, Filming::Clean, 27, &mut rng).unwrap();
            for (truth, seen) in scene.truth.iter().zip(&scene.seen) {
                assert!(truth[R_SHOULDER][0] < truth[L_SHOULDER][0] && truth[NOSE][1] < 0.0);
                let bone = vec3::norm(vec3::sub(truth[R_ELBOW], truth[R_WRIST]));
                assert!((bone - Proportions::MEAN.forearm).abs() < 1e-9);
                let (a, b) = (seen[R_SHOULDER].unwrap(), seen[L_SHOULDER].unwrap());
                let wide = f64::from(b[0] - a[0]) / scene.px_per_metre;
                let true_wide = truth[L_SHOULDER][0] - truth[R_SHOULDER][0];
                assert!((wide / true_wide - 1.0).abs() < 0.35, "{wide} {true_wide}");
            }
        }
        assert!(FilmedScene::from_take(&take(), None, Filming::Clean, 200, &mut rng).is_none());
    }

    #[test]
    fn spoiled_scenes_miss_points_now_and_then() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut missing, mut hips, n) = (0, 0, 300);
        for _ in 0..n {
            let scene = FilmedScene::from_rule(Filming::Drop, 27, &mut rng);
            missing += scene.seen.iter().flat_map(|f| &f[..R_HIP]).filter(|p| p.is_none()).count();
            hips += usize::from(scene.seen.iter().all(|f| f[R_HIP].is_none()));
        }
        let share = missing as f64 / f64::from(n * 27 * 7);
        assert!((0.06..0.14).contains(&share), "{share}");
        assert!((0.5..0.7).contains(&(hips as f64 / f64::from(n))));
    }
}
