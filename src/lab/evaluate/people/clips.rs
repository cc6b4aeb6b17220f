//! Rendered clips: results of a run together with the ground truth, frame by frame at the dataset rate.

use crate::mocap::captured::source::MotionSource;
use crate::rendered_truth::{LIST, RenderedTruth, Visibility};
use anyhow::{Context, Result, ensure};
use ndarray::{Axis, s};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::types::interval::Intervals;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::skeleton::{L_SHOULDER, R_SHOULDER};
use orator_dataset::config::{self, Config};
use orator_formats::keypoints_npz;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Entry of the clip list.
#[derive(Clone, Debug, Deserialize)]
pub struct ListedClip {
    /// Video and truth, relative to the folder.
    pub video: PathBuf,
    pub truth: PathBuf,
    pub condition: String,
    /// first, middle or last: part of the split by bodies, cameras, clothes and motions.
    pub part: String,
    /// Source of captured motion; generated motion has none.
    pub source: Option<String>,
    #[serde(default)]
    pub generated_joints: Vec<usize>,
}

impl ListedClip {
    fn source(&self) -> &str {
        self.source.as_deref().unwrap_or(MotionSource::Generated.name())
    }
}

/// A clip with the ground truth at the frames of its keypoints.
#[derive(Clone, Debug)]
pub struct RenderedClip {
    pub condition: String,
    /// Name of the source of its motion.
    pub source: String,
    /// Joints of captured motion that are generated; errors exclude them.
    pub generated_joints: Vec<usize>,
    pub keypoints: Keypoints,
    /// Ground truth of each frame of the keypoints.
    pub truth: RenderedTruth,
    /// Intervals accepted by `segment` and `lift`.
    pub intervals: Intervals,
}

impl RenderedClip {
    /// Number of frames T.
    pub fn n_frames(&self) -> usize {
        self.truth.n_frames()
    }

    /// Whether each frame is accepted, [T].
    pub fn accepted(&self) -> Vec<bool> {
        let mut accepted = vec![false; self.n_frames()];
        for interval in &self.intervals.intervals {
            accepted[interval.start.min(self.n_frames())..interval.end.min(self.n_frames())].fill(true);
        }
        accepted
    }

    /// Shoulder width in a frontal view at the neck's distance, px.
    pub fn shoulders_px(&self, frame_idx: usize) -> f32 {
        self.px_of_bone(frame_idx, L_SHOULDER, R_SHOULDER)
    }

    /// True distance between two joints, projected at the distance of the first, px.
    pub fn px_of_bone(&self, frame_idx: usize, from: usize, to: usize) -> f32 {
        let joints = self.truth.joints.index_axis(Axis(0), frame_idx);
        let metres = (0..3).map(|k| (joints[[from, k]] - joints[[to, k]]).powi(2)).sum::<f32>().sqrt();
        let depth = self.truth.neck[[frame_idx, 2]] + joints[[from, 2]];
        self.truth.focal_px * metres / depth.max(0.05)
    }

    /// Points of a hand (0 left, 1 right): detected [T, 21, 3], true [T, 21, 2], and their visibility.
    pub fn hand(&self, side: usize) -> HandArrays<'_> {
        let (found, truth, visibility) = match side {
            0 => (&self.keypoints.left_hand, &self.truth.left_hand, &self.truth.left_hand_visibility),
            _ => (&self.keypoints.right_hand, &self.truth.right_hand, &self.truth.right_hand_visibility),
        };
        HandArrays { found: found.view(), truth: truth.view(), visibility: visibility.view() }
    }
}

/// One hand of a clip over time.
#[derive(Clone, Copy, Debug)]
pub struct HandArrays<'a> {
    /// x px, y px, score; [T, 21, 3].
    pub found: ndarray::ArrayView3<'a, f32>,
    /// x px, y px; [T, 21, 2].
    pub truth: ndarray::ArrayView3<'a, f32>,
    /// [T, 21].
    pub visibility: ndarray::ArrayView2<'a, Visibility>,
}

/// Reads the clips of the folder `dir` that the configuration's run has lifted, optionally only those of `part` and of
/// the named `sources` of motion.
///
/// # Errors
/// A missing list or ground truth; a clip that the configuration does not name or that is not lifted yet.
pub fn read(dir: &Path, config_file: &Path, part: Option<&str>, sources: &[MotionSource]) -> Result<Vec<RenderedClip>> {
    let config = config::load(config_file, &[])?;
    let path = dir.join(LIST);
    let text = std::fs::read_to_string(&path).with_context(|| {
        format!(
            "cannot read {}: expected the list of clips that `orator-lab demo draw DIR --people N` writes",
            path.display()
        )
    })?;
    let list: Vec<ListedClip> =
        serde_json::from_str(&text).with_context(|| format!("invalid list of rendered clips {}", path.display()))?;
    let units = units(&config);
    let has_source = |clip: &ListedClip| sources.is_empty() || sources.iter().any(|s| s.name() == clip.source());
    let selected = list.iter().filter(|clip| part.is_none_or(|part| clip.part == part) && has_source(clip));
    let clips = selected.map(|listed| read_clip(dir, listed, &units, &config)).collect::<Result<Vec<_>>>()?;
    ensure!(
        !clips.is_empty(),
        "no clip{}{} in {}",
        part.map_or(String::new(), |p| format!(" of part `{p}`")),
        if sources.is_empty() { "" } else { " with motion of these sources" },
        path.display()
    );
    Ok(clips)
}

fn units(config: &Config) -> Vec<Unit> {
    config::videos::all(config).into_iter().flat_map(|videos| videos.units).collect()
}

fn read_clip(dir: &Path, listed: &ListedClip, units: &[Unit], config: &Config) -> Result<RenderedClip> {
    let video = dir.join(&listed.video);
    let absolute = video.canonicalize().with_context(|| format!("cannot find {}", video.display()))?;
    let unit = units.iter().find(|unit| unit.source.canonicalize().is_ok_and(|source| source == absolute));
    let unit = unit.with_context(|| {
        format!("no entry of {} matches the video {}; add it to `videos`", config.file.display(), video.display())
    })?;
    let work = &config.settings.work.dir;
    let lifted = Artifact::LiftIntervals.path(work, unit);
    let bytes = std::fs::read(&lifted).with_context(|| {
        format!("cannot read {}; run `orator run -c {} --to lift`", lifted.display(), config.file.display())
    })?;
    let intervals = serde_json::from_slice(&bytes).with_context(|| {
        format!("invalid list of intervals {}; remove it and run `orator run` again", lifted.display())
    })?;
    let path = Artifact::Keypoints.path(work, unit);
    let keypoints = keypoints_npz::read(&path)?;
    let times = keypoints_npz::read_extras(&path)?.time_secs;
    let truth = at_times(&RenderedTruth::read(&dir.join(&listed.truth))?, times.as_slice().unwrap_or(&[]));
    ensure!(
        truth.n_frames() == keypoints.n_frames(),
        "{}: {} frames of keypoints, but {} frame times: expected equal numbers",
        path.display(),
        keypoints.n_frames(),
        truth.n_frames()
    );
    let (condition, source) = (listed.condition.clone(), listed.source().to_owned());
    Ok(RenderedClip {
        condition,
        source,
        generated_joints: listed.generated_joints.clone(),
        keypoints,
        truth,
        intervals,
    })
}

/// Ground truth of the frames that are shown at `times`, seconds.
fn at_times(truth: &RenderedTruth, times: &[f64]) -> RenderedTruth {
    let last = truth.n_frames().saturating_sub(1);
    let frames: Vec<usize> =
        times.iter().map(|secs| ((secs * truth.fps.per_sec()).round().max(0.0) as usize).min(last)).collect();
    RenderedTruth {
        fps: truth.fps,
        body: truth.body.select(Axis(0), &frames),
        body_visibility: truth.body_visibility.select(Axis(0), &frames),
        left_hand: truth.left_hand.select(Axis(0), &frames),
        left_hand_visibility: truth.left_hand_visibility.select(Axis(0), &frames),
        right_hand: truth.right_hand.select(Axis(0), &frames),
        right_hand_visibility: truth.right_hand_visibility.select(Axis(0), &frames),
        joints: truth.joints.select(Axis(0), &frames),
        body_joints: truth.body_joints.select(Axis(0), &frames),
        neck: truth.neck.select(Axis(0), &frames),
        focal_px: truth.focal_px,
        up: truth.up,
        head: truth.head.select(Axis(0), &frames),
        mouth: truth.mouth.select(Axis(0), &frames),
        speaks: truth.speaks.select(Axis(0), &frames),
    }
}

/// Exact keypoints of all points inside the image; hands that are entirely outside are missing.
pub fn true_keypoints(clip: &RenderedClip) -> Keypoints {
    let exact = |found: &ndarray::Array3<f32>, truth: &ndarray::Array3<f32>, seen: &ndarray::Array2<Visibility>| {
        let mut exact = ndarray::Array3::zeros(found.raw_dim());
        exact.slice_mut(s![.., .., ..2]).assign(truth);
        for ((t, point), seen) in seen.indexed_iter() {
            if *seen == Visibility::Outside {
                exact.slice_mut(s![t, point, ..]).fill(0.0);
            } else {
                exact[[t, point, 2]] = 1.0;
            }
        }
        exact
    };
    let (found, truth) = (&clip.keypoints, &clip.truth);
    Keypoints {
        fps: found.fps,
        image_size: found.image_size,
        body: exact(&found.body, &truth.body, &truth.body_visibility),
        left_hand: exact(&found.left_hand, &truth.left_hand, &truth.left_hand_visibility),
        right_hand: exact(&found.right_hand, &truth.right_hand, &truth.right_hand_visibility),
        hand_depth: found.hand_depth.clone(),
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use ndarray::{Array1, Array2, Array3};
    use orator_base::types::interval::Interval;
    use orator_base::types::pose2d::{N_BODY, N_HAND};
    use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, N_JOINTS, R_HAND, mirror};
    use orator_base::types::time::FrameRate;

    /// A clip of 40 frames without errors: arms in front of the body, everything visible, all frames accepted.
    pub fn exact() -> RenderedClip {
        let n = 40;
        let mut joints = Array3::zeros((n, N_JOINTS, 3));
        for t in 0..n {
            let sway = 0.05 * (0.4 * t as f32).sin();
            let arm = [[-0.18, 0.0, 0.0], [-0.25, 0.28, -0.05], [-0.15, 0.25 + sway, -0.28]];
            for (k, point) in arm.into_iter().enumerate() {
                joints.slice_mut(s![t, 1 + k, ..]).assign(&ndarray::arr1(&point));
            }
            for k in 0..N_HAND_JOINTS {
                let (finger, bone) = (((k.max(1) - 1) / 4) as f32, if k == 0 { 0.0 } else { ((k - 1) % 4 + 1) as f32 });
                let point = [-0.15 - 0.02 * finger, 0.25 + sway + 0.03 * bone, -0.28 - 0.01 * bone];
                joints.slice_mut(s![t, R_HAND + k, ..]).assign(&ndarray::arr1(&point));
            }
            for joint in (1..4).chain(R_HAND..N_JOINTS) {
                let [x, y, z] = [0, 1, 2].map(|k| joints[[t, joint, k]]);
                joints.slice_mut(s![t, mirror(joint), ..]).assign(&ndarray::arr1(&[-x, y, z]));
            }
        }
        let mut body = Array3::from_elem((n, N_BODY, 2), 300.0);
        let px = |joint: usize, t: usize, k: usize| {
            [320.0, 200.0][k] + 800.0 * joints[[t, joint, k]] / (2.0 + joints[[t, joint, 2]])
        };
        for (t, joint, k) in ndarray::indices((n, 7, 2)) {
            if joint > 0 {
                body[[t, orator_base::motion::upper_body::COCO[joint], k]] = px(joint, t, k);
            }
        }
        let hand = |root: usize| Array3::from_shape_fn((n, N_HAND, 2), |(t, point, k)| px(root + point, t, k));
        let found = |points: &Array3<f32>| {
            let mut found = Array3::from_elem((n, points.shape()[1], 3), 0.9);
            found.slice_mut(s![.., .., ..2]).assign(points);
            found
        };
        let (left, right) = (hand(L_HAND), hand(R_HAND));
        let fps = FrameRate::new(15, 1);
        let keypoints = Keypoints {
            fps,
            image_size: [640, 480],
            body: found(&body),
            left_hand: found(&left),
            right_hand: found(&right),
            hand_depth: None,
        };
        let all_visible = |points: usize| Array2::from_elem((n, points), Visibility::Visible);
        let truth = RenderedTruth {
            fps,
            body,
            body_visibility: all_visible(N_BODY),
            left_hand: left,
            left_hand_visibility: all_visible(N_HAND),
            right_hand: right,
            right_hand_visibility: all_visible(N_HAND),
            joints,
            body_joints: Array3::zeros((n, N_BODY, 3)),
            neck: Array2::from_shape_fn((n, 3), |(_, k)| [0.0, 0.0, 2.0][k]),
            focal_px: 800.0,
            up: [0.0, -1.0, 0.0],
            head: Array2::zeros((n, 3)),
            mouth: Array1::zeros(n),
            speaks: Array1::from_elem(n, true),
        };
        let intervals = Intervals::new(fps, n, vec![Interval { start: 0, end: n }]);
        let (condition, source) = ("front".to_owned(), "generated".to_owned());
        RenderedClip { condition, source, generated_joints: Vec::new(), keypoints, truth, intervals }
    }

    #[test]
    fn times_choose_the_frames_of_the_truth() {
        let truth = at_times(&exact().truth, &[0.0, 0.2, 0.41, 99.0]);
        assert_eq!(truth.n_frames(), 4);
        for (row, frame) in [0, 3, 6, 39].into_iter().enumerate() {
            assert_eq!(truth.joints.index_axis(Axis(0), row), exact().truth.joints.index_axis(Axis(0), frame));
        }
    }

    #[test]
    fn exact_keypoints_miss_what_is_outside() {
        let mut clip = exact();
        clip.truth.left_hand_visibility[[3, 5]] = Visibility::Outside;
        clip.truth.left_hand_visibility[[3, 6]] = Visibility::BehindObject;
        let keypoints = true_keypoints(&clip);
        assert_eq!((keypoints.left_hand[[3, 5, 2]], keypoints.left_hand[[3, 6, 2]]), (0.0, 1.0));
        assert_eq!(keypoints.left_hand[[3, 6, 0]], clip.truth.left_hand[[3, 6, 0]]);
        assert!((clip.shoulders_px(0) - 800.0 * 0.36 / 2.0).abs() < 1e-3);
    }
}
