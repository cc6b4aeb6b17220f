//! Errors of the body lifter and of baselines without a network on captured motion. Scenes: 4 s at 15 frames/s, bones
//! of the mean adult, camera yaw within 60 degrees, pitch 15, roll 4, noisy keypoints with gaps ("drop"). Frames are
//! relative to the neck; prediction and truth of each scene are scaled to the reference size (0.90 m). MPJPE over
//! nose, shoulders, elbows, wrists; P-MPJPE after a similarity alignment per frame. Baselines use exact keypoints and
//! the true bone lengths, scale or mean pose.

use crate::mocap::upper_body::Set;
use crate::train::lifter::errors::{BodyErrors, mean_pose, of_lifted, with_bone_depth, with_mean_depth};
use crate::train::scene::body::{FPS, FilmedScene, Filming, scenes};
use anyhow::{Result, ensure};
use ndarray::{Array3, s};
use orator_base::motion::upper_body::{ARMS, COCO, L_HIP, N_POINTS, NOSE, Pose, R_HIP};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::{Keypoints, N_BODY, N_HAND};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_nn::lifter::body::BodyLifter;
use orator_pipeline::lift::{Lifter, weights};
use serde::Serialize;

/// Default number of scenes per set.
pub const SCENES: usize = 240;
/// Bands of |yaw| with separate errors, degrees.
const BANDS: [(f64, f64); 3] = [(0.0, 20.0), (20.0, 40.0), (40.0, 60.0)];

/// Image centre, px.
const MIDDLE: [f32; 2] = [640.0, 360.0];

/// Body lifter of `orator lift`, and its network alone.
pub struct Lifters {
    complete: Lifter,
    network: BodyLifter,
}

impl Lifters {
    /// Loads the weights given in `settings`, or the built-in ones.
    ///
    /// # Errors
    /// Weights that cannot be read.
    pub fn new(settings: &config::LiftConfig) -> Result<Self> {
        Ok(Self { complete: Lifter::new(settings)?, network: weights::body(&settings.body_weights)? })
    }
}

/// Errors of one method on one set.
#[derive(Clone, Debug, Serialize)]
pub struct BodyRow {
    pub set: String,
    pub method: &'static str,
    /// Keypoints of the method: "drop" or "clean".
    pub input: &'static str,
    pub errors: BodyErrors,
    /// Errors by |yaw|: 0 to 20, 20 to 40, 40 to 60 degrees.
    pub by_yaw: Vec<BodyErrors>,
    /// Share of the frames for which the method gave all points.
    pub complete_share: f64,
}

/// Errors by set of the lifter, its network alone, and three baselines without a network.
///
/// # Errors
/// A set whose takes are all shorter than a scene; a failure of a lifter.
pub fn table(lifters: &Lifters, sets: &[Set], n_scenes: usize) -> Result<Vec<BodyRow>> {
    let mut rows = Vec::new();
    for (set, takes) in sets {
        let (drop, clean) = (scenes(takes, Filming::Drop, n_scenes), scenes(takes, Filming::Clean, n_scenes));
        ensure!(!drop.is_empty(), "every take of {set} is too short: expected at least 4 s");
        let mean = mean_pose(&clean);
        let (drop, clean) = (("drop", &drop[..]), ("clean", &clean[..]));
        let network = |scene: &FilmedScene| Ok(lifters.network.poses(&scene.seen, &[], 1.0)?);
        let with_hands = |scene: &FilmedScene| Ok(lifters.network.poses(&scene.seen, &scene.hands, 1.0)?);
        rows.extend([
            row(set, "orator lift", drop, |scene| lift(&lifters.complete, scene))?,
            row(set, "network alone", drop, network)?,
            row(set, "network with hands", drop, with_hands)?,
            row(set, "orator lift", clean, |scene| lift(&lifters.complete, scene))?,
            row(set, "bone-length depth", clean, |scene| Ok(with_bone_depth(scene)))?,
            row(set, "mean depth per joint", clean, |scene| Ok(with_mean_depth(scene, &mean)))?,
            row(set, "constant mean pose", clean, |scene| Ok(vec![Some(mean); scene.truth.len()]))?,
        ]);
    }
    Ok(rows)
}

fn row(
    set: &str,
    method: &'static str,
    (input, scenes): (&'static str, &[FilmedScene]),
    predict: impl Fn(&FilmedScene) -> Result<Vec<Option<Pose>>>,
) -> Result<BodyRow> {
    let lifted = scenes.iter().map(|scene| Ok((scene, predict(scene)?))).collect::<Result<Vec<_>>>()?;
    let errors = of_lifted(lifted.iter().map(|(scene, poses)| (*scene, &poses[..])));
    let band = |&(low, high): &(f64, f64)| {
        let inside = lifted.iter().filter(|(s, _)| (low..=high).contains(&s.yaw.to_degrees().abs()));
        of_lifted(inside.map(|(scene, poses)| (*scene, &poses[..])))
    };
    let by_yaw = BANDS.iter().map(band).collect();
    let n_frames: usize = scenes.iter().map(|s| s.truth.len()).sum();
    let complete_share = errors.n_frames as f64 / n_frames.max(1) as f64;
    Ok(BodyRow { set: set.to_owned(), method, input, errors, by_yaw, complete_share })
}

/// Lifts a scene with the complete `orator lift` stage.
fn lift(lifter: &Lifter, scene: &FilmedScene) -> Result<Vec<Option<Pose>>> {
    let n_frames = scene.seen.len();
    let none = Array3::zeros((n_frames, N_HAND, 3));
    let mut body = Array3::zeros((n_frames, N_BODY, 3));
    for (t, seen) in scene.seen.iter().enumerate() {
        for (joint, point) in COCO.into_iter().zip(seen) {
            if let Some([x, y]) = *point {
                body.slice_mut(s![t, joint, ..]).assign(&ndarray::arr1(&[x + MIDDLE[0], y + MIDDLE[1], 1.0]));
            }
        }
    }
    let fps = FrameRate::new(FPS as u32, 1);
    let keypoints =
        Keypoints { fps, image_size: [1280, 720], body, left_hand: none.clone(), right_hand: none, hand_depth: None };
    let lifted = lifter.lift_intervals(&keypoints, &[Interval { start: 0, end: n_frames }])?;
    let point = |array: &Array3<f32>, t: usize, j: usize| std::array::from_fn(|k| f64::from(array[[t, j, k]]));
    let pose = |t: usize| {
        let mut pose: Pose = [[f64::NAN; 3]; N_POINTS];
        for joint in ARMS {
            pose[joint] = point(&lifted.motion.joints, t, joint);
        }
        for (i, j) in [NOSE, R_HIP, L_HIP].into_iter().enumerate() {
            pose[j] = point(&lifted.extra, t, i);
        }
        Some(pose)
    };
    Ok((0..n_frames).map(pose).collect())
}

/// The table as text.
pub fn text(rows: &[BodyRow]) -> String {
    let mut text = format!(
        "{:22} {:6} {:>6} {:>8} {:>6} {:>7} {:>9} {:>6}   MPJPE by yaw {}\n",
        "mm",
        "input",
        "MPJPE",
        "P-MPJPE",
        "wrist",
        "|dz|",
        "mm/frame",
        "lifted",
        BANDS.map(|(low, high)| format!("{low}-{high}")).join("  ")
    );
    for same in rows.chunk_by(|a, b| a.set == b.set) {
        text += &format!("{}\n", same[0].set);
        for BodyRow { method, input, errors: e, by_yaw, complete_share, .. } in same {
            let bands: Vec<String> = by_yaw.iter().map(|e| format!("{:5.0}", e.mpjpe)).collect();
            text += &format!(
                "  {method:20} {input:6} {:6.0} {:8.0} {:6.0} {:7.0} {:9.0} {:4.0} %               {}\n",
                e.mpjpe,
                e.p_mpjpe,
                e.wrist,
                e.wrist_depth,
                e.wrist_velocity,
                100.0 * complete_share,
                bands.join(" ")
            );
        }
    }
    text.trim_end().to_owned()
}
