//! The lifter: 2D keypoints to 3D motion, each interval independently, with one set of bone lengths for all.

use super::body::{OUTLIER_FRAMES, SIZE_FRAMES, TRAINED_FPS};
use super::camera::CameraTilt;
use super::weights::HandNetwork;
use super::{body, gaps, hands, lengths, rest, weights};
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3, ArrayViewMut2, ArrayViewMut3, s};
use orator_base::math::gaussian;
use orator_base::motion::bones;
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::{Keypoints, N_HAND, VISIBLE_SCORE, coco};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{self, L_HAND, N_BONES, N_JOINTS, R_HAND, Side};
use orator_dataset::config;
use orator_nn::lifter::body::BodyLifter;

/// Longest gap that is filled, in seconds. `config` limits the gaps that `[segment]` accepts to this.
pub(crate) const MAX_GAP_SECS: f64 = 1.0;

/// Temporal context in seconds: how far before and after a frame keypoints can affect its joints. It covers outlier
/// detection, gap filling, the receptive field of the network, the median of the body size, and smoothing. Beyond that,
/// all frames of a video share the bone lengths, the camera tilt, and the choice between the mirror images of a hand.
pub fn context_secs(settings: &config::LiftConfig) -> f64 {
    // Unreadable weights are reported by the stage itself.
    let window =
        weights::body(&settings.body_weights).map_or(weights::MAX_FRAMES, |body| body.net.config().receptive_field());
    let smooth = (3.0 * settings.smooth_arms.max(settings.smooth_hands)).ceil();
    let frames = OUTLIER_FRAMES + (window / 2) as f64 + SIZE_FRAMES + smooth;
    MAX_GAP_SECS + frames / TRAINED_FPS
}

/// Lifts 2D keypoints to 3D motion.
pub struct Lifter {
    body: BodyLifter,
    hands: HandNetwork,
    smooth_arms: f64,
    smooth_hands: f64,
    level: bool,
}

pub struct Lifted {
    /// The motion; NaN outside the intervals.
    pub motion: Motion,
    /// Nose, right hip, left hip, [T, 3, 3], in the coordinates of the joints (metres); NaN in long gaps.
    pub extra: Array3<f32>,
    /// Bone lengths of the video, metres, for joints 1..=48; 0 for bones that are never visible and for the hand roots.
    pub lengths: [f32; N_BONES],
    /// Camera tilt of each interval.
    pub cameras: Vec<CameraTilt>,
    /// Number of frames with a body.
    pub n_frames: usize,
}

/// Mutable view of one interval of a `Lifted`.
pub struct IntervalView<'a> {
    pub joints: ArrayViewMut3<'a, f32>,
    pub extra: ArrayViewMut3<'a, f32>,
    pub mask: ArrayViewMut2<'a, bool>,
}

impl Lifter {
    /// Loads the networks that `settings` name, or the built-in ones.
    ///
    /// # Errors
    /// Weights that cannot be loaded, with the name of the file.
    pub fn new(settings: &config::LiftConfig) -> Result<Self> {
        let (body, hands) = (weights::body(&settings.body_weights)?, weights::hands(&settings.hand_weights)?);
        let config::LiftConfig { smooth_arms, smooth_hands, level, .. } = *settings;
        Ok(Self { body, hands, smooth_arms, smooth_hands, level })
    }

    /// Lifts a complete video as one interval and returns its motion.
    ///
    /// # Errors
    /// Those of `lift_intervals`.
    pub fn lift(&self, keypoints: &Keypoints) -> Result<Motion> {
        Ok(self.lift_all(keypoints)?.motion)
    }

    /// Lifts a complete video as one interval.
    ///
    /// # Errors
    /// Those of `lift_intervals`.
    pub fn lift_all(&self, keypoints: &Keypoints) -> Result<Lifted> {
        self.lift_intervals(keypoints, &[Interval { start: 0, end: keypoints.n_frames() }])
    }

    /// Lifts and smooths each interval independently, then applies one set of bone lengths to all.
    ///
    /// # Errors
    /// An interval outside the video; keypoint arrays of unequal lengths.
    pub fn lift_intervals(&self, keypoints: &Keypoints, intervals: &[Interval]) -> Result<Lifted> {
        let raw = self.raw(keypoints, intervals, &[])?;
        Ok(self.finish(raw, intervals))
    }

    /// Lifts and smooths each interval independently, without adjusting bone lengths; each hand is in its own frame.
    /// In the intervals `resting`, hands are filled however long they are hidden.
    pub(crate) fn raw(&self, keypoints: &Keypoints, intervals: &[Interval], resting: &[Interval]) -> Result<Lifted> {
        let n_frames = keypoints.n_frames();
        for hand in [&keypoints.left_hand, &keypoints.right_hand] {
            ensure!(
                hand.shape()[0] == n_frames,
                "the body keypoints have {n_frames} frames, those of a hand {}",
                hand.shape()[0]
            );
        }
        let mut lifted = Lifted::empty(keypoints);
        for &interval in intervals {
            let Interval { start, end } = interval;
            ensure!(
                start <= end && end <= n_frames,
                "interval {start}..{end} exceeds the {n_frames} frames of the video"
            );
            self.lift_interval(keypoints, interval, resting, lifted.view(interval))?;
        }
        Ok(lifted)
    }

    /// Applies one length per bone over all `intervals` (parts of those that `lifted` was created for) and attaches
    /// the hands to the wrists. Frames outside are set to NaN.
    pub(crate) fn finish(&self, mut lifted: Lifted, intervals: &[Interval]) -> Lifted {
        lifted.clear_outside(intervals);
        lifted.lengths = lengths::measure(&lifted.motion);
        for &interval in intervals {
            let mut view = lifted.view(interval);
            let camera = CameraTilt::estimate(interval, &view);
            if self.level {
                camera.level(&mut view);
            }
            lifted.cameras.push(camera);
        }
        let lengths = lifted.lengths;
        bones::with_lengths(&mut lifted.motion, &lengths);
        for (root, wrist) in [(L_HAND, skeleton::L_WRIST), (R_HAND, skeleton::R_WRIST)] {
            let wrists = lifted.motion.mask.column(wrist).to_owned();
            lifted.motion.mask.column_mut(root).assign(&wrists);
        }
        let shoulder = lifted.motion.joints.slice(s![.., skeleton::R_SHOULDER, 0]);
        lifted.n_frames = shoulder.iter().filter(|x| x.is_finite()).count();
        lifted
    }

    /// Lifts and smooths one interval at roughly the reference size; each hand is in its own frame with the root at 0.
    fn lift_interval(
        &self,
        keypoints: &Keypoints,
        interval: Interval,
        resting: &[Interval],
        mut into: IntervalView,
    ) -> Result<()> {
        let fps = keypoints.fps.per_sec();
        let max_gap = (MAX_GAP_SECS * fps).round() as usize;
        let frames = |sigma: f64| sigma * fps / TRAINED_FPS;
        body::lift(&self.body, keypoints, interval, max_gap, &mut into)?;
        gaussian::gaussian(into.joints.slice_mut(s![.., ..L_HAND, ..]), frames(self.smooth_arms));
        gaussian::gaussian(into.extra, frames(self.smooth_arms));
        for (root, side, points) in
            [(L_HAND, Side::Left, &keypoints.left_hand), (R_HAND, Side::Right, &keypoints.right_hand)]
        {
            let points = points.slice(s![interval.start..interval.end, .., ..]);
            let depth = keypoints.hand_depth.as_ref();
            let depth =
                depth.map(|depth| depth.slice(s![interval.start..interval.end, usize::from(side == Side::Right), ..]));
            let mut joints = into.joints.slice_mut(s![.., root..root + N_HAND, ..]);
            let mask = into.mask.slice_mut(s![.., root..root + N_HAND]);
            hands::lift(&self.hands, &points, depth, side, (1.0 / fps) as f32, joints.view_mut(), mask)?;
        }
        rest::fill(&mut into.joints, interval, resting);
        for root in [L_HAND, R_HAND] {
            let mut joints = into.joints.slice_mut(s![.., root..root + N_HAND, ..]);
            gaps::bridge(joints.view_mut(), max_gap);
            gaps::hold_ends(joints.view_mut(), max_gap);
            gaussian::gaussian(joints, frames(self.smooth_hands));
        }
        Ok(())
    }
}

impl Lifted {
    fn empty(keypoints: &Keypoints) -> Self {
        let n_frames = keypoints.n_frames();
        let joints = Array3::from_elem((n_frames, N_JOINTS, 3), f32::NAN);
        let mask = Array2::from_elem((n_frames, N_JOINTS), false);
        Self {
            motion: Motion { fps: keypoints.fps, joints, mask },
            extra: Array3::from_elem((n_frames, 3, 3), f32::NAN),
            lengths: [0.0; N_BONES],
            cameras: Vec::new(),
            n_frames: 0,
        }
    }

    /// Clears the frames outside `intervals`.
    fn clear_outside(&mut self, intervals: &[Interval]) {
        let mut end = 0;
        let after_all = self.motion.n_frames();
        for next in intervals.iter().copied().chain([Interval { start: after_all, end: after_all }]) {
            if end < next.start {
                let view = self.view(Interval { start: end, end: next.start });
                let IntervalView { mut joints, mut extra, mut mask } = view;
                joints.fill(f32::NAN);
                extra.fill(f32::NAN);
                mask.fill(false);
            }
            end = end.max(next.end);
        }
    }

    fn view(&mut self, interval: Interval) -> IntervalView<'_> {
        let frames = interval.start..interval.end;
        IntervalView {
            joints: self.motion.joints.slice_mut(s![frames.clone(), .., ..]),
            extra: self.extra.slice_mut(s![frames.clone(), .., ..]),
            mask: self.motion.mask.slice_mut(s![frames, ..]),
        }
    }
}

/// Explains why joints are missing (NaN); `None` if all are present.
pub fn notes(keypoints: &Keypoints, lifted: &Lifted) -> Option<String> {
    let n_frames = keypoints.n_frames();
    let n_hidden = |j: usize| {
        let scores = keypoints.body.slice(s![.., j, 2]);
        scores.iter().filter(|score| score.is_nan() || **score < VISIBLE_SCORE).count()
    };
    (lifted.n_frames < n_frames).then(|| {
        format!(
            "no body in {} of {n_frames} frames (NaN): lifting needs both shoulders within {MAX_GAP_SECS} s; the right \
             shoulder is not detected in {} frames, the left in {}",
            n_frames - lifted.n_frames,
            n_hidden(coco::R_SHOULDER),
            n_hidden(coco::L_SHOULDER)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_keypoints::bodies;

    /// A swaying body; from frame `change` its motion is different and it is larger.
    fn keypoints(n_frames: usize, change: usize) -> Keypoints {
        let positions = [
            (coco::NOSE, 320.0, 100.0),
            (coco::L_SHOULDER, 380.0, 200.0),
            (coco::R_SHOULDER, 260.0, 200.0),
            (coco::L_ELBOW, 400.0, 300.0),
            (coco::R_ELBOW, 240.0, 300.0),
            (coco::L_WRIST, 360.0, 340.0),
            (coco::R_WRIST, 280.0, 340.0),
        ];
        let at = |t: usize, x: f32, y: f32| {
            let (size, pace) = if t < change { (1.0, 0.3) } else { (1.6, 0.9) };
            [320.0 + size * (x - 320.0) + 9.0 * (pace * t as f32).sin(), size * y + 5.0 * (pace * t as f32).cos(), 0.9]
        };
        let hand = |x: f32| {
            Array3::from_shape_fn((n_frames, N_HAND, 3), |(t, point, k)| {
                at(t, x + (point % 4) as f32 * 7.0, 340.0 + point as f32 * 4.0)[k]
            })
        };
        let bodies = bodies(n_frames, [640, 480], |t| {
            positions.map(|(joint, x, y)| {
                let [x, y, _] = at(t, x, y);
                (joint, x, y)
            })
        });
        Keypoints { left_hand: hand(360.0), right_hand: hand(280.0), ..bodies }
    }

    #[test]
    fn keypoints_beyond_the_context_are_ignored() {
        let (n_frames, change) = (240, 160);
        let settings = config::LiftConfig::default();
        let lifter = Lifter::new(&settings).unwrap();
        let complete = [Interval { start: 0, end: n_frames }];
        let raw = |change| lifter.raw(&keypoints(n_frames, change), &complete, &[]).unwrap().motion;
        let (plain, changed) = (raw(n_frames), raw(change));
        let last = change - (context_secs(&settings) * 15.0).ceil() as usize;
        assert!(last > 80, "a context of {} s", context_secs(&settings));
        let until = |motion: &Motion, end: usize| motion.joints.slice(s![..end, .., ..]).to_owned();
        assert_eq!(until(&plain, last), until(&changed, last));
        assert_ne!(until(&plain, change), until(&changed, change), "nothing reaches back");
    }
}
