//! Errors of lifted bodies, and of baselines on the same scenes. Convention: each frame is relative to its neck;
//! prediction and truth of a scene are each scaled by one factor to the reference size, without rotation. MPJPE over
//! nose, shoulders, elbows, wrists; P-MPJPE after a similarity alignment per frame of these points and the neck.

use crate::train::scene::body::FilmedScene;
use crate::train::scene::body_motion::Proportions;
use orator_base::math::procrustes;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{
    BodyPoints, L_SHOULDER, L_WRIST, N_POINTS, NOSE, Pose, R_HIP, R_SHOULDER, R_WRIST, metres_per_unit,
};
use orator_base::types::skeleton;
use serde::Serialize;
use std::fmt;

/// Points included in the errors.
const COUNTED: std::ops::Range<usize> = NOSE..R_HIP;

/// Mean errors in mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BodyErrors {
    pub mpjpe: f64,
    pub p_mpjpe: f64,
    pub wrist: f64,
    /// Wrist error along the line of sight, |dz|.
    pub wrist_depth: f64,
    /// Error of the wrists' displacement from frame to frame.
    pub wrist_velocity: f64,
    /// Number of evaluated frames: those for which a method gives all points.
    pub n_frames: usize,
}

impl fmt::Display for BodyErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mpjpe, p_mpjpe, wrist, wrist_depth, wrist_velocity, .. } = self;
        write!(
            f,
            "MPJPE {mpjpe:3.0}  P-MPJPE {p_mpjpe:3.0}  wrist {wrist:3.0}  (its depth {wrist_depth:3.0}, velocity {wrist_velocity:3.0})"
        )
    }
}

/// Errors of a method over scenes: `lift` gives the poses of a scene (see `of_lifted`).
///
/// # Errors
/// Errors of `lift`.
pub fn of_method(
    scenes: &[FilmedScene],
    lift: impl Fn(&FilmedScene) -> anyhow::Result<Vec<Option<Pose>>>,
) -> anyhow::Result<BodyErrors> {
    let lifted = scenes.iter().map(&lift).collect::<anyhow::Result<Vec<_>>>()?;
    Ok(of_lifted(scenes.iter().zip(lifted.iter().map(Vec::as_slice))))
}

/// Errors of poses lifted from scenes, with any one unit per scene and any neck position. A frame that is `None` or
/// has a point that is not finite is skipped.
pub fn of_lifted<'a>(scenes: impl Iterator<Item = (&'a FilmedScene, &'a [Option<Pose>])>) -> BodyErrors {
    let (mut sum, mut n_steps) = (BodyErrors::default(), 0);
    for (scene, poses) in scenes {
        let finite = |pose: &Pose| pose[COUNTED].iter().flatten().all(|v| v.is_finite());
        let lifted: Vec<Option<Pose>> = poses.iter().map(|pose| pose.filter(finite)).collect();
        let present: Vec<Pose> = lifted.iter().flatten().copied().collect();
        let (scale, true_scale) = (metres_per_unit(&present), metres_per_unit(&scene.truth));
        let mut before: Option<(Pose, Pose)> = None;
        for (pose, truth) in lifted.iter().zip(&scene.truth) {
            let Some(pose) = pose else {
                before = None;
                continue;
            };
            let (p, q) = (to_reference(pose, scale), to_reference(truth, true_scale));
            let e = of_frame(&p, &q);
            sum.mpjpe += e.mpjpe;
            sum.p_mpjpe += e.p_mpjpe;
            sum.wrist += e.wrist;
            sum.wrist_depth += e.wrist_depth;
            sum.n_frames += 1;
            if let Some((p0, q0)) = before {
                let off = |j: usize| vec3::norm(vec3::sub(vec3::sub(p[j], p0[j]), vec3::sub(q[j], q0[j])));
                sum.wrist_velocity += (off(R_WRIST) + off(L_WRIST)) / 2.0;
                n_steps += 1;
            }
            before = Some((p, q));
        }
    }
    let mean = |v: f64, n: usize| 1000.0 * v / n.max(1) as f64;
    let n_frames = sum.n_frames;
    BodyErrors {
        mpjpe: mean(sum.mpjpe, n_frames),
        p_mpjpe: mean(sum.p_mpjpe, n_frames),
        wrist: mean(sum.wrist, n_frames),
        wrist_depth: mean(sum.wrist_depth, n_frames),
        wrist_velocity: mean(sum.wrist_velocity, n_steps),
        n_frames,
    }
}

/// The pose relative to its neck, in metres of the reference body.
fn to_reference(pose: &Pose, scale: f64) -> Pose {
    let neck = vec3::scale(vec3::add(pose[R_SHOULDER], pose[L_SHOULDER]), 0.5);
    pose.map(|p| vec3::scale(vec3::sub(p, neck), scale))
}

fn of_frame(p: &Pose, q: &Pose) -> BodyErrors {
    let distance = |j: usize| vec3::norm(vec3::sub(p[j], q[j]));
    let with_neck = |pose: &Pose| pose[COUNTED].iter().copied().chain([[0.0; 3]]).collect::<Vec<Vec3>>();
    let (from, to) = (with_neck(p), with_neck(q));
    let aligned = procrustes::similarity(&from, &to);
    let after = |j: usize| vec3::norm(vec3::sub(aligned.map_or(from[j], |s| s.apply(from[j])), to[j]));
    let n = COUNTED.len() as f64;
    BodyErrors {
        mpjpe: COUNTED.map(distance).sum::<f64>() / n,
        p_mpjpe: (0..COUNTED.len()).map(after).sum::<f64>() / n,
        wrist: (distance(R_WRIST) + distance(L_WRIST)) / 2.0,
        wrist_depth: [R_WRIST, L_WRIST].map(|j| (p[j][2] - q[j][2]).abs()).iter().sum::<f64>() / 2.0,
        ..BodyErrors::default()
    }
}

/// Mean ground-truth pose of scenes, in metres of the reference body.
pub fn mean_pose(scenes: &[FilmedScene]) -> Pose {
    let mut mean: Pose = [[0.0; 3]; N_POINTS];
    let mut n = 0.0;
    let of_scene = |scene: &FilmedScene| {
        let scale = metres_per_unit(&scene.truth);
        scene.truth.iter().map(|pose| to_reference(pose, scale)).collect::<Vec<Pose>>()
    };
    for pose in scenes.iter().flat_map(of_scene) {
        n += 1.0;
        for (m, p) in mean.iter_mut().zip(&pose) {
            *m = vec3::add(*m, vec3::scale(vec3::sub(*p, *m), 1.0 / n));
        }
    }
    mean
}

/// 2D points of a clean scene with zero depth, in metres at the neck's distance, relative to the neck.
fn flat(scene: &FilmedScene) -> Vec<Pose> {
    let frame = |seen: &BodyPoints| {
        let points: Pose = seen.map(|p| {
            let [x, y] = p.unwrap_or_default();
            [f64::from(x) / scene.px_per_metre, f64::from(y) / scene.px_per_metre, 0.0]
        });
        let neck = vec3::scale(vec3::add(points[R_SHOULDER], points[L_SHOULDER]), 0.5);
        points.map(|p| vec3::sub(p, neck))
    };
    scene.seen.iter().map(frame).collect()
}

/// Baseline: each point at its depth in the mean pose, x and y as observed. Requires a clean scene; uses its true
/// scale.
pub fn with_mean_depth(scene: &FilmedScene, mean: &Pose) -> Vec<Option<Pose>> {
    let with_depth = |pose: Pose| Some(std::array::from_fn(|j| [pose[j][0], pose[j][1], mean[j][2]]));
    flat(scene).into_iter().map(with_depth).collect()
}

/// Baseline: depth from the bone lengths of the mean adult. Each joint lies at the intersection of its line of sight
/// with the sphere around its parent, arms on the side of the camera; the shoulders turn to the side that the nose
/// points to. Requires a clean scene; uses the true camera and neck position.
pub fn with_bone_depth(scene: &FilmedScene) -> Vec<Option<Pose>> {
    let bones = Proportions::MEAN;
    let solve = |seen: &BodyPoints| {
        let rays = seen.map(|p| p.map(|[x, y]| [f64::from(x) / scene.focal_px, f64::from(y) / scene.focal_px, 1.0]));
        let mut pose: Pose = [[0.0; 3]; N_POINTS];
        let middle = vec3::scale(vec3::add(rays[R_SHOULDER]?, rays[L_SHOULDER]?), 0.5);
        let neck = vec3::scale(middle, scene.neck[2]);
        // A nose right of the neck in the image means that the left shoulder is turned away.
        let left_is_away = rays[NOSE]?[0] > middle[0];
        pose[L_SHOULDER] = on_sphere(rays[L_SHOULDER]?, neck, bones.shoulders / 2.0, !left_is_away);
        pose[R_SHOULDER] = on_sphere(rays[R_SHOULDER]?, neck, bones.shoulders / 2.0, left_is_away);
        pose[NOSE] = on_sphere(rays[NOSE]?, neck, bones.nose, true);
        for [shoulder, elbow, wrist] in skeleton::ARMS {
            pose[elbow] = on_sphere(rays[elbow]?, pose[shoulder], bones.upper_arm, true);
            pose[wrist] = on_sphere(rays[wrist]?, pose[elbow], bones.forearm, true);
        }
        Some(pose)
    };
    scene.seen.iter().map(solve).collect()
}

/// Nearer or farther intersection of the line of sight along `ray` (z = 1) with a sphere; without intersection, the
/// point of the line nearest to the centre.
fn on_sphere(ray: Vec3, centre: Vec3, radius: f64, nearer: bool) -> Vec3 {
    let square = vec3::dot(ray, ray);
    let closest = vec3::dot(ray, centre) / square;
    let off = vec3::sub(vec3::scale(ray, closest), centre);
    let half = ((radius * radius - vec3::dot(off, off)).max(0.0) / square).sqrt();
    vec3::scale(ray, if nearer { closest - half } else { closest + half })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::scene::body::Filming;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_truth_in_another_size_is_without_error_and_baselines_are_not() -> anyhow::Result<()> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let scenes: Vec<FilmedScene> = (0..8).map(|_| FilmedScene::from_rule(Filming::Clean, 20, &mut rng)).collect();
        let larger = |s: &FilmedScene| {
            Ok(s.truth.iter().map(|p| Some(p.map(|q| vec3::add(vec3::scale(q, 7.0), [1.0; 3])))).collect())
        };
        let none = of_method(&scenes, larger)?;
        assert!(none.mpjpe < 1e-6 && none.p_mpjpe < 1e-6, "{none}");
        let mean = mean_pose(&scenes);
        let constant = of_method(&scenes, |s| Ok(vec![Some(mean); s.truth.len()]))?;
        let depth = of_method(&scenes, |s| Ok(with_mean_depth(s, &mean)))?;
        let bones = of_method(&scenes, |s| Ok(with_bone_depth(s)))?;
        assert!(depth.mpjpe < constant.mpjpe && bones.mpjpe < constant.mpjpe, "{depth} {bones} {constant}");
        assert!(constant.p_mpjpe < constant.mpjpe && bones.wrist_depth <= bones.wrist);
        Ok(())
    }
}
