//! A camera that looks at a moving body: keypoints as a detector would give them, with noise, bias, outliers and
//! gaps, beside the truth in camera axes. The recipe (angles, focal lengths, noise) is that of a study on this kind
//! of data; ranges stand beside each draw.

use super::body_motion;
use super::body_motion::{Proportions, turn};
use super::hand_shape::normal;
use super::jumps;
use super::noise;
use crate::mocap::upper_body::BodyTake;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{
    L_ELBOW, L_HIP, L_SHOULDER, L_WRIST, MIRROR, N_POINTS, NOSE, Pose, R_HIP, R_SHOULDER, R_WRIST, SeenBody,
};
use orator_base::types::skeleton;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Dataset frames a second, the rate the lifter sees.
pub const FPS: f64 = 15.0;

/// Share of the training's scenes with the noise that real models were measured to have, and the share of those with
/// its bias; the others have one of its size.
const MEASURED_NOISE: f64 = 0.7;
const MEASURED_BIAS: f64 = 0.7;

/// What was filmed: the truth in metres and camera axes, and the keypoints.
#[derive(Clone, Debug)]
pub struct FilmedScene {
    pub truth: Vec<Pose>,
    pub seen: Vec<SeenBody>,
    /// [T]; whether a frame has a gross error (`jumps`), so that nothing is to be learnt from it.
    pub disturbed: Vec<bool>,
    /// Which side the body is seen from on average, radians; 0: from ahead.
    pub yaw: f64,
    /// The neck in metres before the camera, and the camera's focal length in px; the axis meets the picture at 0, 0.
    pub neck: Vec3,
    pub focal_px: f64,
    /// px of a metre at the neck's distance.
    pub px_per_metre: f64,
}

/// What a scene is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filming {
    /// Anybody, at any speed, through detectors that are better and worse, from further round.
    Training,
    /// The convention of the errors, the condition "drop": the common adult, and a detector that errs and misses.
    Drop,
    /// The convention of the errors, with all keypoints exact.
    Clean,
}

impl FilmedScene {
    /// Captured motion: a random stretch of `take`, seen from a random side within 60 degrees. In training an arm may
    /// come from `other`: what the two arms do together is seldom the same twice. `None` when the take is too short.
    pub fn from_take(
        take: &BodyTake,
        other: Option<&BodyTake>,
        filming: Filming,
        n_frames: usize,
        rng: &mut ChaCha8Rng,
    ) -> Option<Self> {
        let training = filming == Filming::Training;
        let mut poses = stretch(take, training, n_frames, rng)?;
        if let Some(other) = other.and_then(|other| stretch(other, training, n_frames, rng)) {
            poses.iter_mut().zip(&other).for_each(|(pose, other)| take_arm(pose, other));
        }
        let as_it_is = training && take.rendered;
        if !as_it_is {
            let bones = if training { Proportions::sample(rng) } else { Proportions::MEAN };
            poses.iter_mut().for_each(|pose| *pose = with_bones(pose, &bones));
        }
        if training && !as_it_is {
            let glance = turn(rng.random_range(-0.5..0.5), rng.random_range(-0.2..0.2), 0.0);
            poses.iter_mut().for_each(|pose| pose[NOSE] = glance.turn(pose[NOSE]));
        }
        Some(Self::filmed(poses, filming, rng))
    }

    /// Motion made by rule.
    pub fn from_rule(filming: Filming, n_frames: usize, rng: &mut ChaCha8Rng) -> Self {
        let poses = body_motion::gesture(rng, n_frames, 1.0 / FPS);
        Self::filmed(poses, filming, rng)
    }

    /// Poses that face the camera, filmed.
    fn filmed(mut poses: Vec<Pose>, filming: Filming, rng: &mut ChaCha8Rng) -> Self {
        let training = filming == Filming::Training;
        if training && rng.random_bool(0.5) {
            poses.iter_mut().for_each(|pose| *pose = MIRROR.map(|j| [-pose[j][0], pose[j][1], pose[j][2]]));
        }
        // yaw within 60 degrees, in training more often less; the camera from 15 below to 15, in training 25, above;
        // roll within 4, in a third of the training within 15
        let yaw = if training && rng.random_bool(0.4) { 0.5 } else { 1.047 };
        let yaw = rng.random_range(-yaw..yaw);
        let above = if training { 0.44 } else { 0.262 };
        let roll = if training && rng.random_bool(0.33) { 0.26 } else { 0.07 };
        let view = turn(0.0, rng.random_range(-0.262..above), rng.random_range(-roll..roll)) * turn(yaw, 0.0, 0.0);
        let truth: Vec<Pose> = poses.iter().map(|pose| pose.map(|p| view.turn(p))).collect();
        // focal length in picture widths; a body of 0.75 m covers 50 to 150 % of the height of a 16:9 picture
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
        let mut seen: Vec<SeenBody> = truth.iter().map(|pose| pose.map(|p| Some(picture(p)))).collect();
        let px_per_metre = focal_px / distance;
        if filming != Filming::Clean {
            let shoulders = vec3::norm(vec3::sub(truth[0][R_SHOULDER], truth[0][L_SHOULDER]));
            if !(training && spoil_as_measured(&mut seen, shoulders * px_per_metre, rng)) {
                spoil(&mut seen, 0.35 * px_per_metre, training, rng);
            }
            lose_hips(&mut seen, 0.35 * px_per_metre, training, rng);
        }
        let disturbed =
            if training { jumps::disturb(&mut seen, 0.35 * px_per_metre, rng) } else { vec![false; seen.len()] };
        Self { truth, seen, disturbed, yaw, neck, focal_px, px_per_metre }
    }
}

/// Noise, outliers and gaps; `shoulders_px`: the true width of the shoulders. In training a detector may be better or
/// worse, and off by a steady bias.
fn spoil(seen: &mut [SeenBody], shoulders_px: f64, training: bool, rng: &mut ChaCha8Rng) {
    // what a detector calls a shoulder or an elbow lies up to a few cm from where a capture has it, all the while
    let bias = if !training {
        0.0
    } else if rng.random_bool(0.5) {
        1.2
    } else {
        4.0
    };
    let much = if training { rng.random_range(-1.2f64..0.7).exp() } else { 1.0 };
    for point in 0..N_POINTS {
        // 1 % of the shoulders; detectors are less sure of wrists and hips
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
                    *v += (shoulders_px * share * (bias + much * stray * normal(rng))) as f32;
                }
            }
        }
        // bursts of 1 to 12 frames: one begins in 1.7 % of the frames, so that a tenth of the frames is missing
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

/// Spoils keypoints as real models were measured to do, in most scenes; says whether it did.
fn spoil_as_measured(seen: &mut [SeenBody], shoulders_px: f64, rng: &mut ChaCha8Rng) -> bool {
    let sets = &noise::measured().bodies;
    if sets.is_empty() || !rng.random_bool(MEASURED_NOISE) {
        return false;
    }
    let set = &sets[rng.random_range(0..sets.len())];
    let much = rng.random_range(-0.7f64..0.4).exp();
    let with_bias = rng.random_bool(MEASURED_BIAS);
    set.apply(seen, shoulders_px, much, with_bias, rng);
    true
}

/// Hips are often not seen: behind a desk, below the picture.
fn lose_hips(seen: &mut [SeenBody], shoulders_px: f64, training: bool, rng: &mut ChaCha8Rng) {
    if rng.random_bool(0.6) {
        seen.iter_mut().for_each(|f| (f[R_HIP], f[L_HIP]) = (None, None));
    } else if training && rng.random_bool(0.5) {
        invent_hips(seen, shoulders_px, rng);
    }
}

/// Hips behind a desk or below the picture: many detectors do not miss them but put them straight below the shoulders.
fn invent_hips(seen: &mut [SeenBody], shoulders_px: f64, rng: &mut ChaCha8Rng) {
    let (below, apart) = (rng.random_range(0.8..1.7), rng.random_range(0.25..0.75));
    let aside = 0.1 * normal(rng);
    for frame in seen.iter_mut() {
        let (Some(right), Some(left)) = (frame[R_SHOULDER], frame[L_SHOULDER]) else { continue };
        for (hip, side) in [(R_HIP, -0.5), (L_HIP, 0.5)] {
            let middle = [0, 1].map(|k| f64::from(right[k] + left[k]) / 2.0);
            let place = [aside + side * apart + 0.02 * normal(rng), below + 0.02 * normal(rng)];
            frame[hip] = frame[hip].map(|_| [0, 1].map(|k| (middle[k] + shoulders_px * place[k]) as f32));
        }
    }
}

/// A random stretch of a take at the dataset's rate, turned so that it faces the camera on average.
fn stretch(take: &BodyTake, training: bool, n_frames: usize, rng: &mut ChaCha8Rng) -> Option<Vec<Pose>> {
    let speed = if training { rng.random_range(-0.5f64..0.4).exp() } else { 1.0 };
    let step = speed * take.fps / FPS;
    let room = take.poses.len() as f64 - 1.0 - step * (n_frames as f64 - 1.0);
    if room < 0.0 {
        return None;
    }
    let start = rng.random_range(0.0..=room);
    let poses: Vec<Pose> = (0..n_frames).map(|i| between(&take.poses, start + step * i as f64)).collect();
    let ahead = turn(-facing(&poses), 0.0, 0.0);
    Some(poses.iter().map(|pose| pose.map(|p| ahead.turn(p))).collect())
}

/// Gives `pose` the left arm of `other`, held to the shoulders as it was there.
fn take_arm(pose: &mut Pose, other: &Pose) {
    let across = turn(facing(std::slice::from_ref(pose)) - facing(std::slice::from_ref(other)), 0.0, 0.0);
    let from = |joint: usize| across.turn(vec3::sub(other[joint], other[L_SHOULDER]));
    let shoulder = pose[L_SHOULDER];
    pose[L_ELBOW] = vec3::add(shoulder, from(L_ELBOW));
    pose[L_WRIST] = vec3::add(shoulder, from(L_WRIST));
}

/// Frames of a scene that errors are measured on (4 s), and the seed of the scenes.
const MEASURED_FRAMES: usize = 60;
const MEASURED_SEED: u64 = 20_000;

/// `n` scenes to measure errors on, of `takes` in turn or, when there are none, of motion made by rule: the same ones
/// whenever asked. Takes shorter than a scene are left out; nothing when all are.
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

/// The pose at a time between two frames.
fn between(poses: &[Pose], at: f64) -> Pose {
    let before = (at.max(0.0) as usize).min(poses.len() - 1);
    let after = (before + 1).min(poses.len() - 1);
    let share = at - before as f64;
    std::array::from_fn(|j| {
        std::array::from_fn(|k| poses[before][j][k] + share * (poses[after][j][k] - poses[before][j][k]))
    })
}

/// Mean yaw of the shoulders: 0 faces the camera.
fn facing(poses: &[Pose]) -> f64 {
    let across = poses.iter().fold([0.0; 3], |sum, p| vec3::add(sum, vec3::sub(p[L_SHOULDER], p[R_SHOULDER])));
    (-across[2]).atan2(across[0])
}

/// The pose with every bone's direction kept and its length changed.
fn with_bones(pose: &Pose, bones: &Proportions) -> Pose {
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
        // turned away: a scene turns it back to the camera
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
