//! Training windows of an adaptation, drawn from the speaker's keypoints: windows as they are, for the losses without
//! labels, and windows of the lifted and thereby known skeleton under random cameras.

use super::skeleton::{ArmLengths, metres_per_px, with_lengths};
use crate::lifter::body::BodyLifter;
use candle_core::Result;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{self, Vec3};
use orator_base::motion::upper_body::{BodyPoints, L_SHOULDER, N_POINTS, Pose, R_SHOULDER};
use orator_base::motion::view::body::BodyView;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Number of windows drawn from one stretch, over which the apparent size of the speaker is assumed to be constant.
pub const GROUP: usize = 16;
/// Loss weight of each point: nose, arms, hips.
pub const WEIGHTS: [f32; N_POINTS] = [1.0, 1.0, 1.2, 1.5, 1.0, 1.2, 1.5, 0.7, 0.7];
/// Standard deviation of the keypoint noise of labelled windows, and of its constant part, in shoulder widths.
const NOISE: f64 = 0.012;
/// Width of the picture of labelled windows, px.
const WIDTH: f64 = 1280.0;

/// Keypoints of consecutive frames of one video.
#[derive(Clone, Debug)]
pub struct KeypointStretch {
    pub frames: Vec<BodyPoints>,
    /// Frames per frame of the network.
    pub step: f64,
    /// Principal point and focal length, px.
    pub centre_px: [f64; 2],
    pub focal_px: f64,
}

impl KeypointStretch {
    /// Position of the neck relative to the principal point, px; `None` if a shoulder is not visible.
    pub fn neck(&self, t: usize) -> Option<[f64; 2]> {
        let (right, left) = (self.frames[t][R_SHOULDER]?, self.frames[t][L_SHOULDER]?);
        Some([0, 1].map(|k| f64::from(right[k] + left[k]) / 2.0 - self.centre_px[k]))
    }
}

/// A stretch with its lifted poses.
pub struct LiftedStretch<'a> {
    pub keypoints: &'a KeypointStretch,
    /// Poses in metres, for every frame, without constant bone lengths.
    pub poses: Vec<Pose>,
    pub metres_per_px: Vec<f64>,
    /// Frames with both shoulders.
    pub usable: Vec<usize>,
}

impl<'a> LiftedStretch<'a> {
    /// Lifts `stretches`, except those in which no body is visible for more than half a window.
    pub fn all(lifter: &BodyLifter, stretches: &'a [KeypointStretch]) -> Result<Vec<Self>> {
        let mut all = Vec::new();
        for keypoints in stretches {
            let poses = lifter.poses(&keypoints.frames, keypoints.step)?;
            let Some(mut poses) = poses.into_iter().collect::<Option<Vec<Pose>>>() else { continue };
            let metres_per_px = metres_per_px(&poses, keypoints.step);
            for (pose, scale) in poses.iter_mut().zip(&metres_per_px) {
                *pose = pose.map(|p| vec3::scale(p, *scale));
            }
            let usable: Vec<usize> = (0..poses.len()).filter(|t| keypoints.neck(*t).is_some()).collect();
            if !usable.is_empty() {
                all.push(Self { keypoints, poses, metres_per_px, usable });
            }
        }
        Ok(all)
    }

    fn frame(&self, rng: &mut ChaCha8Rng) -> usize {
        self.usable[rng.random_range(0..self.usable.len())]
    }
}

/// Windows of the speaker's own keypoints, `GROUP` from each stretch; lengths in units of the window.
#[derive(Default)]
pub struct OwnWindows {
    /// Input of the network, [B, N_IN, window].
    pub numbers: Vec<f32>,
    /// Keypoints relative to the neck with z = 0, [B, 9, 3]: the output of the network is relative to them.
    pub seen: Vec<f32>,
    /// Loss weights of the points, [B, 9]; 0: not visible.
    pub weights: Vec<f32>,
    /// Position of the neck relative to the principal point, [B, 2].
    pub neck: Vec<f32>,
    /// Units per focal length, [B].
    pub per_focal: Vec<f32>,
    /// px per unit relative to the mean of the group, [B].
    pub scales: Vec<f32>,
}

impl OwnWindows {
    /// Appends `GROUP` windows of a stretch, half of the groups mirrored; `None` if a window shows no body.
    pub fn draw(&mut self, lifted: &LiftedStretch, window: usize, rng: &mut ChaCha8Rng) -> Option<()> {
        let keypoints = lifted.keypoints;
        let is_mirrored = rng.random_bool(0.5);
        let first = self.scales.len();
        for _ in 0..GROUP {
            let t = lifted.frame(rng);
            let mut view = BodyView::around(&keypoints.frames, t, window, keypoints.step)?;
            let mut neck = keypoints.neck(t)?;
            if is_mirrored {
                (view, neck[0]) = (view.mirrored(), -neck[0]);
            }
            for (point, weight) in WEIGHTS.into_iter().enumerate() {
                let [x, y] = view.middle(point);
                self.seen.extend([x, y, 0.0]);
                self.weights.push(weight * view.numbers[(3 * point + 2) * window + window / 2]);
            }
            self.neck.extend(neck.map(|v| v as f32 / view.scale));
            self.per_focal.push(view.scale / keypoints.focal_px as f32);
            self.scales.push(view.scale);
            self.numbers.extend_from_slice(&view.numbers);
        }
        let mean = self.scales[first..].iter().sum::<f32>() / GROUP as f32;
        self.scales[first..].iter_mut().for_each(|scale| *scale /= mean);
        Some(())
    }
}

/// Windows with known positions.
#[derive(Default)]
pub struct LabelledWindows {
    /// Input of the network, [B, N_IN, window].
    pub numbers: Vec<f32>,
    /// Output that the network should give, [B, 9, 3].
    pub targets: Vec<f32>,
}

impl LabelledWindows {
    /// Appends `GROUP` windows of the lifted skeleton with these bone lengths, filmed by a random camera with keypoint
    /// noise; the same points are visible as in the video. `None` if a window shows no body.
    pub fn draw(
        &mut self,
        lifted: &LiftedStretch,
        lengths: &ArmLengths,
        window: usize,
        rng: &mut ChaCha8Rng,
    ) -> Option<()> {
        // Cameras as in the training of the lifter: up to 1 radian beside the view of the video, focal lengths
        // in widths of the picture, of which the body covers a half to one and a half times the height.
        let about = Rotation::about;
        let turn = about([0.0, 1.0, 0.0], rng.random_range(-1.0..1.0))
            * about([1.0, 0.0, 0.0], rng.random_range(-0.25..0.25))
            * about([0.0, 0.0, 1.0], rng.random_range(-0.1..0.1));
        let focal: f64 = rng.random_range(1.0..2.2);
        let distance = (focal * 0.75 / (rng.random_range(0.5..1.5) * 9.0 / 16.0)).max(0.85);
        let neck: Vec3 = [
            rng.random_range(-0.25..0.25) * distance / focal,
            rng.random_range(-0.25..0.2) * distance / focal,
            distance,
        ];
        let px_per_metre = WIDTH * focal / distance;
        let deviation = NOISE * lengths[0] * px_per_metre;
        let bias: [[f64; 2]; N_POINTS] = std::array::from_fn(|_| [0, 1].map(|_| deviation * normal(rng)));
        let poses: Vec<Pose> =
            lifted.poses.iter().map(|pose| with_lengths(pose, lengths).map(|p| turn.turn(p))).collect();
        let mut frames: Vec<BodyPoints> = Vec::with_capacity(poses.len());
        for (pose, seen) in poses.iter().zip(&lifted.keypoints.frames) {
            let mut frame: BodyPoints = [None; N_POINTS];
            for (point, bias) in bias.iter().enumerate().filter(|(point, _)| seen[*point].is_some()) {
                let [x, y, z] = vec3::add(pose[point], neck);
                let mut px =
                    |v: f64, bias: f64| (WIDTH * focal * v / z.max(0.2) + bias + deviation * normal(rng)) as f32;
                frame[point] = Some([px(x, bias[0]), px(y, bias[1])]);
            }
            frames.push(frame);
        }
        for _ in 0..GROUP {
            let t = lifted.frame(rng);
            let view = BodyView::around(&frames, t, window, lifted.keypoints.step)?;
            let grow = px_per_metre / f64::from(view.scale);
            for (point, p) in poses[t].iter().enumerate() {
                let [x, y] = view.middle(point);
                let [to_x, to_y, to_z] = p.map(|v| (v * grow) as f32);
                self.targets.extend([to_x - x, to_y - y, to_z]);
            }
            self.numbers.extend_from_slice(&view.numbers);
        }
        Some(())
    }
}

/// Number of mean 0 and variance 1, within 3: the sum of three uniform ones.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..3).map(|_| rng.random_range(-1.0f64..1.0)).sum()
}
