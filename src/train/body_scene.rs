//! A camera that looks at a moving body: keypoints as a detector would give them, with noise, bias, outliers and
//! gaps, beside the truth in camera axes. The recipe (angles, focal lengths, noise) is that of a study on this kind
//! of data; ranges stand beside each draw.

use super::body_motion::{self, Proportions, turn};
use crate::motion::mocap::Take;
use crate::motion::upper_body::{
    L_ELBOW, L_HIP, L_SHOULDER, L_WRIST, MIRROR, N_POINTS, NOSE, Pose, R_ELBOW, R_HIP, R_SHOULDER, R_WRIST, Seen,
};
use crate::motion::vec3::{self, Vec3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Dataset frames a second, the rate the lifter sees.
pub const FPS: f64 = 15.0;

/// What was filmed: the truth in metres and camera axes, and the keypoints.
#[derive(Clone, Debug)]
pub struct Scene {
    pub truth: Vec<Pose>,
    pub seen: Vec<Seen>,
    /// px of a metre at the neck's distance.
    pub px_per_metre: f64,
}

/// Whose bones a captured motion is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// Another for every scene: training.
    Any,
    /// The common adult: validation.
    Mean,
}

impl Scene {
    /// Captured motion: a random stretch of `take` at a random speed, seen from a random side within 60 degrees.
    /// `None` when the take is too short.
    pub fn of_take(take: &Take, body: Body, n_frames: usize, clean: bool, rng: &mut ChaCha8Rng) -> Option<Self> {
        let speed = if body == Body::Any { rng.random_range(-0.5f64..0.4).exp() } else { 1.0 };
        let step = speed * take.fps / FPS;
        let room = take.poses.len() as f64 - 1.0 - step * (n_frames as f64 - 1.0);
        if room < 0.0 {
            return None;
        }
        let start = rng.random_range(0.0..=room);
        let mut poses: Vec<Pose> = (0..n_frames).map(|i| between(&take.poses, start + step * i as f64)).collect();
        let bones = if body == Body::Any { Proportions::draw(rng) } else { Proportions::MEAN };
        poses.iter_mut().for_each(|pose| *pose = with_bones(pose, &bones));
        let ahead = turn(-facing(&poses), 0.0, 0.0);
        let glance = turn(rng.random_range(-0.5..0.5), rng.random_range(-0.2..0.2), 0.0);
        for pose in &mut poses {
            *pose = pose.map(|p| ahead.turn(p));
            pose[NOSE] = glance.turn(pose[NOSE]);
        }
        Some(Self::filmed(poses, clean, rng))
    }

    /// Motion made by rule.
    pub fn of_rule(n_frames: usize, clean: bool, rng: &mut ChaCha8Rng) -> Self {
        let poses = body_motion::gesture(rng, n_frames, 1.0 / FPS);
        Self::filmed(poses, clean, rng)
    }

    /// Poses that face the camera, filmed.
    fn filmed(mut poses: Vec<Pose>, clean: bool, rng: &mut ChaCha8Rng) -> Self {
        if rng.random_bool(0.5) {
            poses.iter_mut().for_each(|pose| *pose = MIRROR.map(|j| [-pose[j][0], pose[j][1], pose[j][2]]));
        }
        // yaw within 60 degrees, most often less; pitch: the camera from 15 below to 25 above; roll within 4
        let yaw = if rng.random_bool(0.5) { rng.random_range(-1.05..1.05) } else { rng.random_range(-0.5..0.5) };
        let view = turn(0.0, rng.random_range(-0.26..0.44), rng.random_range(-0.07..0.07)) * turn(yaw, 0.0, 0.0);
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
        let mut seen: Vec<Seen> = truth.iter().map(|pose| pose.map(|p| Some(picture(p)))).collect();
        let px_per_metre = focal_px / distance;
        if !clean {
            spoil(&mut seen, 0.35 * px_per_metre, rng);
        }
        Self { truth, seen, px_per_metre }
    }
}

/// Noise, bias, outliers and gaps; `shoulders_px`: the true width of the shoulders.
fn spoil(seen: &mut [Seen], shoulders_px: f64, rng: &mut ChaCha8Rng) {
    let much = rng.random_range(-1.2f64..0.7).exp();
    for point in 0..N_POINTS {
        // 1 % of the shoulders; detectors are less sure of wrists and hips
        let share = match point {
            R_WRIST | L_WRIST => 0.012,
            R_HIP | L_HIP => 0.018,
            _ => 0.010,
        };
        let bias = [0, 1].map(|_| 1.2 * normal(rng));
        for frame in seen.iter_mut() {
            let stray = if rng.random_bool(0.01) { 12.0 } else { 1.0 };
            if let Some(p) = &mut frame[point] {
                for (v, bias) in p.iter_mut().zip(bias) {
                    *v += (shoulders_px * share * much * (bias + stray * normal(rng))) as f32;
                }
            }
        }
        let gaps = if rng.random_bool(0.5) { 0.0 } else { rng.random_range(0.0..0.06) };
        let mut t = 0;
        while t < seen.len() {
            if rng.random_bool(gaps) {
                let n = rng.random_range(1..=12);
                seen.iter_mut().skip(t).take(n).for_each(|f| f[point] = None);
                t += n;
            }
            t += 1;
        }
        if (point == R_WRIST || point == L_WRIST || point == NOSE) && rng.random_bool(0.03) {
            seen.iter_mut().for_each(|f| f[point] = None);
        }
    }
    if rng.random_bool(0.6) {
        seen.iter_mut().for_each(|f| (f[R_HIP], f[L_HIP]) = (None, None));
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
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
    for (shoulder, elbow, wrist) in [(R_SHOULDER, R_ELBOW, R_WRIST), (L_SHOULDER, L_ELBOW, L_WRIST)] {
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
    use rand::SeedableRng;

    fn take() -> Take {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let poses = body_motion::gesture(&mut rng, 300, 1.0 / 60.0);
        // turned away: a scene turns it back to the camera
        Take {
            name: "t".into(),
            fps: 60.0,
            poses: poses.iter().map(|p| p.map(|q| turn(2.5, 0.0, 0.0).turn(q))).collect(),
        }
    }

    #[test]
    fn a_clean_scene_is_its_own_projection() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20 {
            let scene = Scene::of_take(&take(), Body::Mean, 27, true, &mut rng).unwrap();
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
        assert!(Scene::of_take(&take(), Body::Mean, 200, true, &mut rng).is_none());
    }

    #[test]
    fn spoiled_scenes_miss_points_now_and_then() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut missing, mut hips, n) = (0, 0, 300);
        for _ in 0..n {
            let scene = Scene::of_rule(27, false, &mut rng);
            missing += scene.seen.iter().flat_map(|f| &f[..R_HIP]).filter(|p| p.is_none()).count();
            hips += usize::from(scene.seen.iter().all(|f| f[R_HIP].is_none()));
        }
        let share = missing as f64 / (n * 27 * 7) as f64;
        assert!((0.04..0.2).contains(&share), "{share}");
        assert!((0.5..0.7).contains(&(hips as f64 / n as f64)));
    }
}
