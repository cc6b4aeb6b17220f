//! Camera of the video from which a motion was lifted, with an assumed focal length, and the body's position before it.

use crate::render::PinholeCamera;
use anyhow::{Context as _, ensure};
use orator_base::math::order::median;
use orator_base::math::vec3::{Vec3, add, cross, dot};
use orator_base::types::pose2d::{Keypoints, VISIBLE_SCORE, coco};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, R_ELBOW, R_SHOULDER, R_WRIST};
use orator_base::types::time::FrameRate;

/// Assumed focal length relative to the longer side of the image. If it is wrong, the body seems too near or too far.
pub const FOCAL_RATIO: f64 = 1.2;
/// Joints with their keypoints.
pub const PAIRS: [[usize; 2]; 6] = [
    [L_SHOULDER, coco::L_SHOULDER],
    [R_SHOULDER, coco::R_SHOULDER],
    [L_ELBOW, coco::L_ELBOW],
    [R_ELBOW, coco::R_ELBOW],
    [L_WRIST, coco::L_WRIST],
    [R_WRIST, coco::R_WRIST],
];
/// Minimum number of these correspondences for a position estimate.
const MIN_CORRESPONDENCES: usize = 4;
/// Minimum depth of a neck, metres.
const MIN_DEPTH_METRES: f64 = 0.2;
/// Half width of the window in which positions are averaged, s.
const AVERAGING_SECS: f64 = 0.1;

/// Camera of a video, and the position of the neck in front of it in every frame of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceCamera {
    fps: FrameRate,
    /// Width and height of the video frame, px.
    image_size: [f64; 2],
    /// Neck positions in camera axes (x right, y down, z forward), metres.
    necks: Vec<Vec3>,
}

/// A lifted joint (metres from the neck, camera axes) and its keypoint (focal lengths from the image centre).
type Correspondence = (Vec3, [f64; 2]);

impl SourceCamera {
    /// Fits the camera that projects a motion's joints onto the keypoints of its frames; the neck's depth is constant.
    ///
    /// # Errors
    /// The numbers of frames differ, or no frame shows enough keypoints.
    pub fn fit(motion: &Motion, keypoints: &Keypoints) -> anyhow::Result<Self> {
        let n_frames = motion.n_frames();
        ensure!(
            keypoints.n_frames() == n_frames,
            "the keypoints have {} frames, the motion has {n_frames}: expected the same clip",
            keypoints.n_frames()
        );
        let image_size = keypoints.image_size.map(f64::from);
        let focal_px = FOCAL_RATIO * image_size[0].max(image_size[1]);
        let frames: Vec<Vec<Correspondence>> = (0..n_frames)
            .map(|t| {
                let correspondence = |[joint, point]: [usize; 2]| {
                    let at = [0, 1, 2].map(|k| f64::from(motion.joints[[t, joint, k]]));
                    let px = [0, 1].map(|k| f64::from(keypoints.body[[t, point, k]]));
                    let ray = [0, 1].map(|k| (px[k] - (image_size[k] - 1.0) / 2.0) / focal_px);
                    let is_known = keypoints.body[[t, point, 2]] >= VISIBLE_SCORE;
                    (is_known && at.iter().chain(&ray).all(|v| v.is_finite())).then_some((at, ray))
                };
                PAIRS.into_iter().filter_map(correspondence).collect()
            })
            .collect();
        let depths = frames.iter().filter_map(|matches| depth(matches));
        let depth = median(depths).context(
            "cannot estimate the camera of the video: no frame shows shoulders, elbows and wrists well enough",
        )?;
        let positions: Vec<Option<[f64; 2]>> = frames.iter().map(|matches| lateral_position(matches, depth)).collect();
        let half_width = (AVERAGING_SECS * motion.fps.per_sec()).round() as usize;
        let averaged = |t: usize| {
            mean(positions[t.saturating_sub(half_width)..(t + half_width + 1).min(n_frames)].iter().flatten())
        };
        let known: Vec<(usize, [f64; 2])> = (0..n_frames).filter_map(|t| Some((t, averaged(t)?))).collect();
        let necks = (0..n_frames).filter_map(|t| between(&known, t)).map(|[x, y]| [x, y, depth]).collect();
        Ok(Self { fps: motion.fps, image_size, necks })
    }

    /// Camera for images of `size` px at a time of the motion, for a body whose neck is at `neck` (cm) in the world.
    pub fn at(&self, secs: f64, neck: Vec3, size: [usize; 2]) -> PinholeCamera {
        let frame = (secs * self.fps.per_sec()).max(0.0);
        let at = |frame: usize| self.necks.get(frame).or(self.necks.last()).copied().unwrap_or([0.0, 0.0, 1.0]);
        let (before, after) = (at(frame as usize), at(frame as usize + 1));
        let [x, y, z] = [0, 1, 2].map(|k| before[k] + frame.fract() * (after[k] - before[k]));
        let longer = usize::from(self.image_size[1] > self.image_size[0]);
        let focal_px = FOCAL_RATIO * size[longer] as f64;
        let position = add(neck, [-100.0 * x, 100.0 * y, 100.0 * z]);
        PinholeCamera::looking_at(size, focal_px, position, add(position, [0.0, 0.0, -100.0]), 0.0)
    }
}

/// Least-squares depth of the neck at which the joints project onto their keypoints.
fn depth(matches: &[Correspondence]) -> Option<f64> {
    if matches.len() < MIN_CORRESPONDENCES {
        return None;
    }
    // Each correspondence gives two equations, position · row = value, for x and y.
    let rows =
        matches.iter().flat_map(|&([x, y, z], [u, v])| [([1.0, 0.0, -u], u * z - x), ([0.0, 1.0, -v], v * z - y)]);
    let (mut columns, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for (row, value) in rows {
        for k in 0..3 {
            columns[k] = add(columns[k], row.map(|v| v * row[k]));
        }
        right = add(right, row.map(|v| v * value));
    }
    let [a, b, c] = columns;
    let depth = dot(a, cross(b, right)) / dot(a, cross(b, c));
    (depth > MIN_DEPTH_METRES && depth.is_finite()).then_some(depth)
}

/// Position of the neck parallel to the image plane, at a given depth, metres.
fn lateral_position(matches: &[Correspondence], depth: f64) -> Option<[f64; 2]> {
    let positions: Vec<[f64; 2]> =
        matches.iter().map(|&(at, ray)| [0, 1].map(|k| ray[k] * (at[2] + depth) - at[k])).collect();
    if positions.len() < MIN_CORRESPONDENCES { None } else { mean(positions.iter()) }
}

fn mean<'a>(positions: impl Iterator<Item = &'a [f64; 2]>) -> Option<[f64; 2]> {
    let (sum, n) = positions.fold(([0.0; 2], 0.0), |([x, y], n), at| ([x + at[0], y + at[1]], n + 1.0));
    (n > 0.0).then(|| sum.map(|v| v / n))
}

/// Position at frame `t`, interpolated linearly between the nearest known frames.
fn between(known: &[(usize, [f64; 2])], t: usize) -> Option<[f64; 2]> {
    let after = known.partition_point(|(frame, _)| *frame < t);
    let next = known.get(after).or(known.last())?;
    let last = known.get(after.saturating_sub(1)).unwrap_or(next);
    if next.0 <= last.0 || t <= last.0 {
        return Some(if t <= last.0 { last.1 } else { next.1 });
    }
    let share = ((t - last.0) as f64 / (next.0 - last.0) as f64).min(1.0);
    Some([0, 1].map(|k| last.1[k] + share * (next.1[k] - last.1[k])))
}
